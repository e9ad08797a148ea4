"""Classical controllers as kernels, for export to C, WebAssembly and FMU."""
