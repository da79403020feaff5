"""The report of a score file: its set, verified, drawn and explained, as a page."""
