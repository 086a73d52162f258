// The growth towards the horizon: the counterpart of jaxbrdf/models/horizon.py.
#ifndef JB_HORIZON_CL
#define JB_HORIZON_CL

#include "numerics.cl"

#define JB_LEAST_COSINE 1e-6f

// log2((1 / cos_i + 1 / cos_o) / 2), one division for both.
JB_INLINE jb_real jb_log2_mean_secant(const jb_real3 wi, const jb_real3 wo) {
    const jb_real i = jb_max(wi.z, JB_REAL(JB_LEAST_COSINE));
    const jb_real o = jb_max(wo.z, JB_REAL(JB_LEAST_COSINE));
    return jb_log2(0.5f * (i + o) / (i * o));
}

#endif
