"""What may be commanded at all: arming, other hands, axes that do not obey, statuses that cannot be true."""
