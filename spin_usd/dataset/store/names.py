"""The names of what lies in a dataset's folder, whatever kinds of file its pictures have."""

DESCRIPTION = "dataset.json"
STAGE = "stage"
RECORDS = "records"
CACHE = "cache"
