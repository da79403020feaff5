"""The report of the experiment with the teleoperated arm: its page, tables and pictures."""
