"""The studies that come with shellmb, and solutions that are not ours."""
