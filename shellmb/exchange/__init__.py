"""Exchange with other programs: steps that can be taken back, inputs, FMUs and preCICE."""
