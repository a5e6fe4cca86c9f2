"""What accuracy costs in time: sweeps of a scene against a reference (`shellmb study`)."""

from shellmb.calling import callable_module

callable_module(__name__, "shellmb.api.studies:study")
