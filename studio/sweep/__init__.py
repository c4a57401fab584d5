"""The same rehearsal again and again, with faults of several sizes: how much is too much?"""
