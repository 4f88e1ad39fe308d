"""One campaign as the logs of many programs would have it, and what must come of each.

Nothing here shares code with the reader of recordings: the generator knows what it wrote, and the
answer that is expected is that of the clean copy.
"""
