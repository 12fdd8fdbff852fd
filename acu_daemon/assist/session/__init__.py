"""The estimation session of a pass: refit, choice of the model, prediction buffer.  Pure."""
