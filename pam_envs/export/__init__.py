"""Export of environments and plants as C, WebAssembly, FMU or PTX, from their own kernels."""
