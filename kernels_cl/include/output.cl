// From log-reflectance to reflectance: the counterpart of jaxbrdf/models/output.py.
#ifndef JB_OUTPUT_CL
#define JB_OUTPUT_CL

#include "numerics.cl"

// exp(80) = 5.5e34, four decades below the largest float.
#define JB_LARGEST_LOG 80.0f

// exp of a logarithm, bounded; a NaN stays.
jb_real jb_reflectance(const jb_real log_f) { return jb_exp(log_f > JB_LARGEST_LOG ? JB_REAL(JB_LARGEST_LOG) : log_f); }

// f where both directions leave the front of the surface, else zero; NaN where a component of either is NaN or infinite.
// A subnormal cosine counts as zero: JAX flushes it, and so do many devices.
jb_real3 jb_above_horizon(const jb_real3 wi, const jb_real3 wo, const jb_real3 f) {
    const jb_integer lit = (wi.z >= FLT_MIN) & (wo.z >= FLT_MIN);
    // zero, or NaN
    const jb_real fault = 0.0f * (wi.x + wi.y + wi.z + wo.x + wo.y + wo.z);
    const jb_real none = JB_REAL(0.0f);
    const jb_real3 out = {(lit ? f.x : none) + fault, (lit ? f.y : none) + fault, (lit ? f.z : none) + fault};
    return out;
}

#endif
