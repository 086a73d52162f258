// A bundle's sampler: the counterpart of VISIBLE_VIEW_PROXY in jaxbrdf/sampling/view_proxy.py. Nine numbers a node, nodes
// (azimuths, elevations, 9). All happens in the frame in which the
// viewer's azimuth is zero.
//
// The slopes' covariance is that of a triangular root here, A = [[ax, 0], [r ay, t ay]], t = sqrt(1 - r^2): the density is
// the same for any root, and this one needs no difference of products.
#ifndef JB_PROXY_CL
#define JB_PROXY_CL

#include "directions.cl"
#include "numerics.cl"
#include "polar.cl"

#define JB_PROXY_NUMBERS 9

// Share of cosine-distributed draws (FLOOR in defensive.py).
#define JB_FLOOR 0.02f

// ln(1e-4) / ln 2: of the least roughness.
#define JB_LOG2_ROUGHNESS -13.2877124f
#define JB_LEAST_ROUGHNESS 1e-4f

// Ends of the slopes' and of the correlation's ranges (proxy.py).
#define JB_STEEPEST 10.0f
#define JB_MOST_CORRELATED 0.999f

#define JB_INVERSE_PI 0.318309886f

typedef struct {
    jb_real diffuse;      // chance of the tilted cosine; 1 - diffuse of the mirrored lobe
    jb_real specular;
    jb_real3 tilted;      // normal of the tilted cosine
    jb_real alpha_x;
    jb_real alpha_y;
    jb_real r;
    jb_real t;
    jb_real slope_x;
    jb_real slope_y;
} jb_Proxy;

JB_INLINE jb_real jb_steepness(const jb_real x) { return JB_STEEPEST * jb_tanh(x * (1.0f / JB_STEEPEST)); }

JB_INLINE jb_real jb_roughness(const jb_real x) {
    return jb_max(jb_exp2(jb_sigmoid(-x) * JB_LOG2_ROUGHNESS), JB_REAL(JB_LEAST_ROUGHNESS));
}

// v / |v|; the normal where v is too short to have a direction.
JB_INLINE jb_real3 jb_unit(const jb_real3 v) {
    const jb_real inverse = jb_safe_rsqrt(jb_dot(v, v));
    const jb_real3 out = {v.x * inverse, v.y * inverse, inverse > 0.0f ? v.z * inverse : JB_REAL(1.0f)};
    return out;
}

// Places along an axis of `count` nodes and what lies beyond them; a viewer that is no number has the first.
typedef struct {
    jb_lanes low;
    jb_lanes beyond;
} jb_Step;

// x - 1/2 rounded to the nearest is x rounded down, or at a whole x perhaps the node before, which gives the same value.
JB_INLINE jb_Step jb_step(const jb_real x, const int last) {
    jb_Step step;
    const jb_real rounded = (jb_max(x - 0.5f, JB_REAL(0.0f)) + JB_ROUNDER) - JB_ROUNDER;
    step.low.all = jb_min(rounded, JB_REAL((float)last));
    step.beyond.all = x - step.low.all;
    return step;
}

// The nine numbers for a viewer, linear between nodes (azimuths, elevations, 9).
JB_INLINE void jb_proxy_numbers(
    __global const float *nodes, const int azimuths, const int elevations, const jb_real3 wo, jb_real *x) {
    const jb_real theta = jb_upper_atan2(jb_sin_theta(wo), jb_max(wo.z, JB_REAL(0.0f)));
    const jb_Step up = jb_step(jb_at_most(theta * (0.636619772f * (elevations - 1)), (float)(elevations - 1)), elevations - 2);
    const jb_Step round = jb_step(azimuths > 1 ? jb_full_turn(wo) * (float)azimuths : JB_REAL(0.0f), azimuths - 1);
    for (int q = 0; q < JB_PROXY_NUMBERS; ++q) {
        jb_lanes out;
        for (int k = 0; k < JB_WIDTH; ++k) {
            const int i = (int)up.low.lane[k], j = (int)round.low.lane[k];
            __global const float *a = nodes + JB_PROXY_NUMBERS * (elevations * j + i) + q;
            out.lane[k] = a[0] + (a[JB_PROXY_NUMBERS] - a[0]) * up.beyond.lane[k];
            if (azimuths > 1) {
                __global const float *b = nodes + JB_PROXY_NUMBERS * (elevations * (j + 1 < azimuths ? j + 1 : 0) + i) + q;
                const float next = b[0] + (b[JB_PROXY_NUMBERS] - b[0]) * up.beyond.lane[k];
                out.lane[k] += (next - out.lane[k]) * round.beyond.lane[k];
            }
        }
        x[q] = out.all;
    }
}

JB_INLINE jb_Proxy jb_proxy_at(
    __global const float *nodes, const int azimuths, const int elevations, const jb_real3 wo) {
    jb_real x[JB_PROXY_NUMBERS];
    jb_proxy_numbers(nodes, azimuths, elevations, wo, x);
    jb_Proxy p;
    p.diffuse = jb_sigmoid(x[0] - x[3]);
    p.specular = jb_sigmoid(x[3] - x[0]);
    const jb_real3 tilted = {-jb_steepness(x[1]), -jb_steepness(x[2]), JB_REAL(1.0f)};
    p.tilted = jb_unit(tilted);
    p.alpha_x = jb_roughness(x[4]);
    p.alpha_y = jb_roughness(x[5]);
    p.r = JB_MOST_CORRELATED * jb_tanh(x[6]);
    p.t = jb_safe_sqrt((1.0f - p.r) * (1.0f + p.r));
    p.slope_x = jb_steepness(x[7] * p.alpha_x);
    p.slope_y = jb_steepness(x[8] * p.alpha_y);
    return p;
}

// M^T w: the direction as the standard surface of unit roughness sees it.
JB_INLINE jb_real3 jb_standard_view(const jb_Proxy p, const jb_real3 w) {
    const jb_real3 out = {
        p.alpha_x * w.x + p.r * p.alpha_y * w.y, p.t * p.alpha_y * w.y, w.z - p.slope_x * w.x - p.slope_y * w.y};
    return out;
}

// Both directions lifted off the horizon, added: along the half vector.
JB_INLINE jb_real3 jb_both(const jb_real3 wi, const jb_real3 wo) {
    const jb_real3 light = jb_lift(wi), view = jb_lift(wo);
    const jb_real3 sum = {light.x + view.x, light.y + view.y, light.z + view.z};
    return sum;
}

// Density of wi above the horizon; all in the viewer's frame, `both` too, whose digits are lost if that is added there.
JB_INLINE jb_real jb_proxy_density(const jb_Proxy p, const jb_real3 wi, const jb_real3 wo, const jb_real3 both) {
    const jb_real3 view = jb_lift(wo), wh = jb_unit(both);
    const jb_real x = (wh.x + p.slope_x * wh.z) / p.alpha_x;
    const jb_real y = ((wh.y + p.slope_y * wh.z) / p.alpha_y - p.r * x) / p.t;
    const jb_real spread = x * x + y * y + wh.z * wh.z;
    const jb_real3 seen = jb_standard_view(p, view);
    const jb_real flat = seen.x * seen.x + seen.y * seen.y;
    const jb_real length = jb_safe_sqrt(flat + seen.z * seen.z);
    // twice the area that is seen, in the form that does not cancel where the surface is seen from behind
    const jb_real area = seen.z > 0.0f ? length + seen.z : flat / jb_max(length - seen.z, JB_REAL(JB_TINY));
    const jb_real mirrored =
        0.5f * JB_INVERSE_PI / (p.alpha_x * p.alpha_y * p.t * spread * spread * jb_max(area, JB_REAL(JB_TINY)));
    const jb_real cosine = JB_INVERSE_PI * jb_max(jb_dot(wi, p.tilted), JB_REAL(0.0f));
    return JB_FLOOR * JB_INVERSE_PI * wi.z + (1.0f - JB_FLOOR) * (p.diffuse * cosine + p.specular * mirrored);
}

// Density [1/sr] with which `jb_proxy_sample` draws wi.
JB_INLINE jb_real jb_proxy_pdf(
    __global const float *nodes, const int azimuths, const int elevations, const jb_real3 wi, const jb_real3 wo) {
    const jb_Azimuth phi = jb_azimuth_of(wo);
    const jb_Proxy p = jb_proxy_at(nodes, azimuths, elevations, wo);
    const jb_real3 both = jb_turn_back(phi, jb_both(wi, wo));
    const jb_real density = jb_proxy_density(p, jb_turn_back(phi, wi), jb_turn_back(phi, wo), both);
    // zero, or NaN
    const jb_real fault = 0.0f * (wi.x + wi.y + wi.z + wo.x + wo.y + wo.z);
    return ((wi.z > 0.0f) & (wo.z > 0.0f) ? density : JB_REAL(0.0f)) + fault;
}

// A cosine-distributed direction of u in [0, 1)^2 (Shirley and Chiu 1997).
JB_INLINE jb_real3 jb_cosine_draw(const jb_real u, const jb_real v) {
    const jb_real a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f;
    const jb_integer is_wide = jb_abs(a) > jb_abs(b);
    const jb_real radius = is_wide ? a : b;
    const jb_real across = is_wide ? b : a;
    const jb_real ratio = jb_abs(radius) > JB_TINY ? across / (jb_abs(radius) > JB_TINY ? radius : JB_REAL(1.0f)) : JB_REAL(0.0f);
    const jb_Angle angle = jb_angle_of_turn(is_wide ? 0.125f * ratio : 0.25f - 0.125f * ratio);
    const jb_real x = radius * angle.cos, y = radius * angle.sin;
    const jb_real3 out = {x, y, jb_safe_sqrt(1.0f - x * x - y * y)};
    return out;
}

// w under the shortest rotation that takes the normal to n.
JB_INLINE jb_real3 jb_tilt(const jb_real3 w, const jb_real3 n) {
    const jb_real across = n.x * w.x + n.y * w.y;
    const jb_real a = w.z - across / (1.0f + n.z);
    const jb_real3 out = {w.x + a * n.x, w.y + a * n.y, w.z * n.z - across};
    return out;
}

// The viewer mirrored about a normal that it sees (Dupuy and Benyoub 2023).
JB_INLINE jb_real3 jb_mirrored_draw(const jb_Proxy p, const jb_real3 wo, const jb_real u, const jb_real v) {
    const jb_real3 view = jb_lift(wo);
    const jb_real3 seen = jb_unit(jb_standard_view(p, view));
    const jb_real behind = (seen.x * seen.x + seen.y * seen.y) / (1.0f - jb_min(seen.z, JB_REAL(0.0f)));
    const jb_real height = seen.z > 0.0f ? 1.0f + seen.z : behind;
    const jb_real drop = v * height;
    const jb_real sine = jb_safe_sqrt(drop * (2.0f - drop));
    const jb_Angle phi = jb_angle_of_turn(u);
    const jb_real x = sine * phi.cos + seen.x, y = sine * phi.sin + seen.y, z = (1.0f - v) * height;
    const jb_real3 stretched = {
        p.alpha_x * x - p.slope_x * z, p.alpha_y * (p.r * x + p.t * y) - p.slope_y * z, z};
    const jb_real3 wh = jb_unit(stretched);
    const jb_real twice = 2.0f * jb_dot(view, wh);
    const jb_real3 out = {twice * wh.x - view.x, twice * wh.y - view.y, twice * wh.z - view.z};
    return out;
}

// A direction to the light of u in [0, 1)^3: u.x chooses the lobe, u.y and u.z the direction; `pdf` is its density.
JB_INLINE jb_real3 jb_proxy_sample(
    __global const float *nodes, const int azimuths, const int elevations, const jb_real3 wo, const jb_real3 u,
    jb_real *pdf) {
    const jb_Azimuth phi = jb_azimuth_of(wo);
    const jb_Proxy p = jb_proxy_at(nodes, azimuths, elevations, wo);
    const jb_real3 view = jb_turn_back(phi, wo);
    const jb_real3 about_normal = jb_cosine_draw(u.y, u.z);
    const jb_real3 tilted = jb_tilt(about_normal, p.tilted), mirrored = jb_mirrored_draw(p, view, u.y, u.z);
    const jb_real chance = u.x - JB_FLOOR;
    const jb_integer is_diffuse = chance < (1.0f - JB_FLOOR) * p.diffuse, is_floor = chance < 0.0f;
    jb_real3 wi;
    wi.x = is_floor ? about_normal.x : (is_diffuse ? tilted.x : mirrored.x);
    wi.y = is_floor ? about_normal.y : (is_diffuse ? tilted.y : mirrored.y);
    wi.z = is_floor ? about_normal.z : (is_diffuse ? tilted.z : mirrored.z);
    const jb_real density = jb_proxy_density(p, wi, view, jb_both(wi, view));
    *pdf = (wi.z > 0.0f) & (wo.z > 0.0f) ? density : JB_REAL(0.0f);
    const jb_Azimuth back = {phi.cos, -phi.sin};
    return jb_turn_back(back, wi);
}

#endif
