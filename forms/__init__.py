"""Weak forms of shellmb in UFL: functions of the state that read like the paper.

Nothing here creates a function, a measure or a mesh, or knows a time level; schemes decide at which
state each form is taken. Equation numbers are those of Bauchau, Choi and Bottasso, *On the
Modeling of Shells in Multibody Dynamics*, Multibody System Dynamics 8 (2002) 459-489.
"""
