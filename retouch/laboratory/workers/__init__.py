"""Workers: processes here or of a Dask cluster that run jobs, of a data set or of a study."""
