"""Whether stated errors are true: runs with errors beside references, far finer or exact"""
