// Elementary functions by arithmetic alone, and forms that stay finite at their singular points: the counterpart of
// jaxbrdf/core/numerics.py. Polynomials are by experiments/derive_polynomials.py; the bounds are tested over the whole
// range of each function, at every width.
#ifndef JB_NUMERICS_CL
#define JB_NUMERICS_CL

#include "vector.cl"

// 4 FLT_MIN: the smallest number whose reciprocal and square root are normal numbers too.
#define JB_TINY 4.7019774e-38f

// 1.5 * 2^23: added to a number below 2^22 it leaves the nearest whole one in the last bits.
#define JB_ROUNDER 12582912.0f

// 1 / sqrt(x) for x > JB_TINY, to 3e-7 relative: a guess from the exponent, off by 3.4%, and three Newton steps, each of
// which squares the error and takes it times 3 / 2.
JB_INLINE jb_real jb_rsqrt(const jb_real x) {
    jb_real y = JB_AS_REAL(0x5f3759df - (JB_AS_INTEGER(x) >> 1));
    const jb_real half_x = 0.5f * x;
    y = y * (1.5f - half_x * y * y);
    y = y * (1.5f - half_x * y * y);
    return y * (1.5f - half_x * y * y);
}

// 1 / sqrt(x); zero up to JB_TINY.
JB_INLINE jb_real jb_safe_rsqrt(const jb_real x) {
    return x > JB_TINY ? jb_rsqrt(jb_max(x, JB_REAL(JB_TINY))) : JB_REAL(0.0f);
}

// sqrt(max(x, 0)) to 4e-7 relative; zero up to JB_TINY.
JB_INLINE jb_real jb_safe_sqrt(const jb_real x) { return x * jb_safe_rsqrt(x); }

// 2^x to 3e-7 relative for x from -126 to 127. A NaN stays.
JB_INLINE jb_real jb_bounded_exp2(const jb_real x) {
    const jb_real rounded = x + JB_ROUNDER;
    const jb_real t = x - (rounded - JB_ROUNDER);
    jb_real p = 1.326472731307149e-3f * t + 9.671512991189957e-3f;
    p = p * t + 5.550733581185341e-2f;
    p = p * t + 0.24022242426872253f;
    p = p * t + 0.6931470036506653f;
    p = p * t + 1.0f;
    return JB_AS_REAL(JB_AS_INTEGER(p) + (JB_AS_INTEGER(rounded) << 23));
}

// The same for any x, which is clamped to that range.
JB_INLINE jb_real jb_exp2(const jb_real x) { return jb_bounded_exp2(jb_at_most(jb_at_least(x, -126.0f), 127.0f)); }

// c0 + c1 x + ... + c8 x^8 in pairs (Estrin's scheme), which wait for each other half as long as by Horner's rule.
JB_INLINE jb_real jb_degree_8(
    const jb_real x, const float c0, const float c1, const float c2, const float c3, const float c4, const float c5,
    const float c6, const float c7, const float c8) {
    const jb_real x2 = x * x;
    const jb_real x4 = x2 * x2;
    const jb_real low = (c0 + c1 * x) + (c2 + c3 * x) * x2;
    const jb_real high = (c4 + c5 * x) + (c6 + c7 * x) * x2;
    return low + x4 * (high + c8 * x4);
}

// log2(x) of a normal x > 0, to 3e-7 relative: the exponent, and a polynomial of the mantissa in
// [sqrt(1/2), sqrt(2)).
JB_INLINE jb_real jb_log2(const jb_real x) {
    const jb_integer exponent = (JB_AS_INTEGER(x) - 0x3f3504f3) >> 23;
    const jb_real t = JB_AS_REAL(JB_AS_INTEGER(x) - (exponent << 23)) - 1.0f;
    const jb_real p = jb_degree_8(
        t, 1.4426950216293335f, -0.7213473320007324f, 0.48091062903404236f, -0.3607036769390106f, 0.28791624307632446f,
        -0.23894482851028442f, 0.21571563184261322f, -0.20726971328258514f, 0.12583690881729126f);
    // a whole number below 2^22 as a float, by its bits
    const jb_real whole = JB_AS_REAL(exponent + 0x4b400000) - JB_ROUNDER;
    return p * t + whole;
}

// Angle of (x, y) from the x axis for y >= 0, in [0, pi], to 3e-7 relative; zero at the origin.
JB_INLINE jb_real jb_upper_atan2(const jb_real y, const jb_real x) {
    const jb_real across = jb_abs(x);
    const jb_real larger = jb_max(across, y);
    const jb_real ratio = larger > JB_TINY ? jb_min(across, y) / jb_max(larger, JB_REAL(JB_TINY)) : JB_REAL(0.0f);
    const jb_real p = jb_degree_8(
        ratio * ratio, 1.0f, -0.33333152532577515f, 0.19993773102760315f, -0.14211055636405945f, 0.10666004568338394f,
        -7.552213221788406e-2f, 4.321185126900673e-2f, -1.6367921605706215e-2f, 2.920690691098571e-3f);
    const jb_real near = p * ratio;
    const jb_real angle = y > across ? 1.57079637f - near : near;
    return x < 0.0f ? 3.14159274f - angle : angle;
}

// Sine and cosine of an angle.
typedef struct {
    jb_real cos;
    jb_real sin;
} jb_Angle;

// Of 2 pi turn for |turn| <= 1, each within 2e-7: of the distance to the nearest quarter, and then as many quarters on.
JB_INLINE jb_Angle jb_angle_of_turn(const jb_real turn) {
    const jb_real rounded = 4.0f * turn + JB_ROUNDER;
    const jb_integer quarter = JB_AS_INTEGER(rounded);
    const jb_real t = turn - 0.25f * (rounded - JB_ROUNDER);
    const jb_real t2 = t * t;
    const jb_real s = t * (6.2831854820251465f + t2 * (-41.3416633605957f + t2 * (81.59235382080078f + t2 * -75.39361572265625f)));
    const jb_real c = 1.0f + t2 * (-19.73916244506836f + t2 * (64.92242431640625f + t2 * -83.62918853759766f));
    const jb_integer is_odd = (quarter & 1) == 1, is_second_half = (quarter & 2) == 2;
    const jb_real x = is_odd ? -s : c, y = is_odd ? c : s;
    const jb_Angle angle = {is_second_half ? -x : x, is_second_half ? -y : y};
    return angle;
}

// tanh(x) to 5e-7 relative: a series near zero, where the other form would cancel.
JB_INLINE jb_real jb_tanh(const jb_real x) {
    const jb_real x2 = x * x;
    const jb_real near = x * (1.0f + x2 * (-0.333333333f + x2 * (0.133333333f + x2 * (-0.0539682540f + x2 * 0.0218694885f))));
    const jb_real grown = jb_exp2(jb_at_most(2.88539008f * jb_abs(x), 60.0f));
    const jb_real far = 1.0f - 2.0f / (grown + 1.0f);
    return jb_abs(x) < 0.4f ? near : (x < 0.0f ? -far : far);
}

// ln(1 + exp(x)), to 4e-7 of it or of one.
JB_INLINE jb_real jb_softplus(const jb_real x) {
    const jb_real beyond = jb_log2(1.0f + jb_exp2(-1.44269504f * jb_abs(x)));
    return jb_max(x, JB_REAL(0.0f)) + 0.693147181f * beyond;
}

// 1 / (1 + exp(-x)).
JB_INLINE jb_real jb_sigmoid(const jb_real x) { return 1.0f / (1.0f + jb_exp2(-1.44269504f * x)); }

#endif
