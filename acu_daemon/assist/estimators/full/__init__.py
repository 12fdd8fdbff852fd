"""The `full` estimator: a batch of least squares for orbit, angle biases and station, with a prior.  Pure."""
