"""Tests of stated errors: runs with errors beside references, far finer or exact"""
