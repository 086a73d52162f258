// The growth towards the horizon, if HORIZON is: the counterpart of jaxbrdf/models/horizon.py.
#ifndef JAXBRDF_HORIZON_CL
#define JAXBRDF_HORIZON_CL

#include "memory.cl"

#ifdef HORIZON

#define HORIZON_PARAMETER , WEIGHTS float *horizon
#define HORIZON_ARGUMENT , horizon
#define LEAST_COSINE 1e-6f

// ln((1 / cos_i + 1 / cos_o) / 2).
float log_mean_secant(const float3 wi, const float3 wo) {
    return log(0.5f / fmax(wi.z, LEAST_COSINE) + 0.5f / fmax(wo.z, LEAST_COSINE));
}

#else

#define HORIZON_PARAMETER
#define HORIZON_ARGUMENT

#endif

#endif
