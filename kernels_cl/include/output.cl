// From log-reflectance to reflectance: the counterpart of jaxbrdf/models/output.py.
#ifndef JB_OUTPUT_CL
#define JB_OUTPUT_CL

#include "numerics.cl"

// log2(exp(80)): f stays below 5.5e34, four decades from the largest float.
#define JB_LARGEST_LOG2 115.415604f

// f = 2^x of x = log2(f), bounded; a NaN stays. The host has scaled the last layer to give logarithms to the base 2.
JB_INLINE jb_real jb_reflectance(const jb_real log2_f) { return jb_exp2(jb_at_most(log2_f, JB_LARGEST_LOG2)); }

// f where both directions leave the front of the surface, else zero; NaN where a component of either is NaN or infinite.
JB_INLINE jb_real3 jb_above_horizon(const jb_real3 wi, const jb_real3 wo, const jb_real3 f) {
    const jb_integer lit = (wi.z > 0.0f) & (wo.z > 0.0f);
    // zero, or NaN
    const jb_real fault = 0.0f * (wi.x + wi.y + wi.z + wo.x + wo.y + wo.z);
    const jb_real none = JB_REAL(0.0f);
    const jb_real3 out = {(lit ? f.x : none) + fault, (lit ? f.y : none) + fault, (lit ? f.z : none) + fault};
    return out;
}

#endif
