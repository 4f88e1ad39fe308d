"""The commands: what each is called and takes, and what runs it, imported when it is called."""
