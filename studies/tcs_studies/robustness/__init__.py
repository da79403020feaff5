"""The study of robustness behind Tables I and III of the TCS paper."""
