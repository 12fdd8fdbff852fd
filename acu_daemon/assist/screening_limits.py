"""The constants of the screening in one table: the scale of each, and the figure behind it.  Pure.

Scales: the beam, the noise, the drive, the AGC's level, the elements' a-priori sigmas, and time.  What each check is
worth, and what was left out because it was worth nothing, is in docs/decisions/0081-screening-by-ablation.md.
"""

# Beam: beamwidths on the sky
NEAR_BEAMS = 0.2  # near the path in any case: what autotrack itself is off by
SIDE_LOBE_BEAMS = (1.05, 2.2)  # around the 1.2 to 2 of a first side lobe: noise and the path's own error
JUMP_BEAMS = 0.5  # a track that left the path by such a step was never on it
DRIFT_SCATTERS = 2.0  # a drift goes 3.5 times as far as its offsets scatter, an encoder that jumps about less than 1
DRIFT_BEAMS_S = 0.03  # a second: a side lobe keeps its offset, another satellite does not

# Noise: sigmas
NEAR_SIGMAS = 6.0  # one good reading in 10^8 is farther off
CORRELATED_RATIO = 2.0  # of the noise squared: a mean product beyond it is not white; hunting of twice the noise
REACH = 2.0  # times as far off as is near an axis may hunt
NEAR_SHARE = 0.9  # of the readings must lie near the orbit that fits them

# Drive: share of its limit
ACCELERATION_SHARE = 0.3  # of the acceleration: beyond it autotrack lags

# Level, dB
LOW_DB = 3.0  # under the level kept before: a side lobe's
HIGH_DB = 6.0  # over the level kept before: what was kept was the side lobe

# Elements: a-priori sigmas
NARROW = 3.0  # how much room the elements are given; with 30 another satellite is believed
STRAIN = 20.0  # squared: an orbit so much less likely than another is a side lobe's (18 first locks of 18)

# Another satellite, as a replay says it (docs/decisions/0049-another-satellite.md)
MANOEUVRE_M_S, ORBITAL_M_S = 10.0, 7500.0  # a large one, of a low orbit
MOST_MANOEUVRES, MOST_ALONG_S = 1.5, 400.0  # what a satellite of these elements may need: 0 of 800 readings of itself
SEARCH_S, STEP_S = 600.0, 10.0  # early and late, to find where its path comes nearest
LEAST_COUNT, ENOUGH = 10, 120  # readings: fewer, or shorter than BEFORE_S, tell little of the plane and the rate

# Time, seconds
LEAST_DRIFT_S = 0.5  # a drift over less is noise
WINDOW_S, WINDOW_COUNT = 3.0, 8  # the newest readings that tell whether offsets are correlated, both at least
SUSTAINED_S = 0.9  # off the path for so long without a jump, a track was on its way already
CLEAR_S = 4.0  # off the path for so long, a track shows when it left; so often a reset is considered
MAX_GAP_S = 6.0  # a longer gap between readings breaks the acquisition: nobody saw what happened
TRIAL_S = (8.0, 64.0)  # once readings were no orbit's: how long the next ones must be one's, and at most
RECENT_S = 10.0  # newest readings that an offset, a level or an orbit is judged by; the least for a reset
YOUNG_S = 20.0  # a fit to less may have been another satellite's from the first reading on
BEFORE_S = 30.0  # kept readings that tell the usual level, and must stay near an orbit that takes in others
RESET_S = 75.0  # of an orbit's readings always replace what was kept; a minute of side lobe never does
RESET_SHARE = 3.0  # times as long as what was kept are enough
JUDGED_S = 120.0  # so much of the kept readings is enough to judge others
WAITING_S = 200.0  # longer than twice RESET_S
