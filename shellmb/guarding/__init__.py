"""What keeps strangers' files and folders, links and closed streams from doing harm."""
