"""One campaign as logs of many programs, and the expected result of each.

This package shares no code with the reader of recordings: the generator knows what it wrote, and
the expected answer is that of the clean copy.
"""
