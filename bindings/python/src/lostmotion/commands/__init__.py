"""The commands: names, arguments, and functions that are imported on use."""
