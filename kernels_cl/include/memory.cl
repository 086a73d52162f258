#ifndef JAXBRDF_MEMORY_CL
#define JAXBRDF_MEMORY_CL

// Where the parameters lie that every work item reads.
#ifdef WEIGHTS_OUTGROW_CONSTANT_MEMORY
#define WEIGHTS __global const
#else
#define WEIGHTS __constant
#endif

#endif
