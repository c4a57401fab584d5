"""Flags that several verbs share: of people, headsets, scales of photos, and folders of results."""
