"""The report of a study with people: its page, tables and files."""
