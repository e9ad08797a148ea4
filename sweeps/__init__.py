"""Many tasks on many processes, of this machine or of a Dask cluster: for benchmarks and agents."""
