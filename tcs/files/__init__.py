"""Files: YAML documents, data paths, whole-file writing, and a safe reader of joblib files.

In: names and paths of data files, and bytes that may be damaged or malicious. Out: checked
documents, plain containers and arrays, or an error of one line; files that are written completely
or not at all.
"""
