"""All that knows the insides of Mitsuba and Dr.Jit: libLLVM, variants, mesh buffers, rays, the plugin."""
