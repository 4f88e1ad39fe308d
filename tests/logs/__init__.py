"""One campaign as logs of many programs, and the expected result of each.

Nothing here shares code with the reader of recordings: the generator knows what it wrote, and the
answer that is expected is that of the clean copy.
"""
