"""The report of success under error, beside Tables I and III of the TCS paper."""
