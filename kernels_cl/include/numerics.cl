// Forms that stay finite at their singular points: the counterpart of jaxbrdf/core/numerics.py.
#ifndef JAXBRDF_NUMERICS_CL
#define JAXBRDF_NUMERICS_CL

// 4 FLT_MIN: the smallest number whose reciprocal and square root are normal numbers too.
#define TINY 4.7019774e-38f

// sqrt(max(x, 0)).
float safe_sqrt(const float x) { return x > TINY ? sqrt(x) : 0.0f; }

// a / b, zero where b is too small to divide by.
float safe_divide(const float a, const float b) { return fabs(b) > TINY ? a / b : 0.0f; }

// v / |v|, and the normal where v is too short to have a direction.
float3 safe_normalize(const float3 v) {
    const float length = safe_sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    return length > 0.0f ? v / length : (float3)(0.0f, 0.0f, 1.0f);
}

// atan2(y, x), zero at the origin.
float safe_atan2(const float y, const float x) {
    return fabs(x) <= TINY && fabs(y) <= TINY ? 0.0f : atan2(y, x);
}

#endif
