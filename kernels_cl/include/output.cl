// From log-reflectance to reflectance: the counterpart of jaxbrdf/models/output.py.
#ifndef JAXBRDF_OUTPUT_CL
#define JAXBRDF_OUTPUT_CL

// exp(80) = 5.5e34, four decades below the largest float.
#define LARGEST_LOG 80.0f

// exp of the three logarithms, bounded; a comparison, since fmin would hide a NaN.
float3 reflectance(const float *log_f) {
    const float3 bounded = (float3)(
        log_f[0] > LARGEST_LOG ? LARGEST_LOG : log_f[0],
        log_f[1] > LARGEST_LOG ? LARGEST_LOG : log_f[1],
        log_f[2] > LARGEST_LOG ? LARGEST_LOG : log_f[2]);
    return exp(bounded);
}

#endif
