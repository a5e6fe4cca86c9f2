"""Protection from strangers' files and folders, links and closed streams."""
