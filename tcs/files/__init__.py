"""Files: YAML documents, data paths, whole-file writing, and the safe reader of joblib files.

In: paths and bytes from users and from the package's own data folders. Out: checked documents and
plain containers, or one located error; files written whole or not at all.
"""
