"""The report of the pick-and-place experiment, beside the figures of the ITCM thesis."""
