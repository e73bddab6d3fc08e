"""Code that depends on internals of Mitsuba and Dr.Jit: libLLVM, variants, mesh buffers, rays, the plugin."""
