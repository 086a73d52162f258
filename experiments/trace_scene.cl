// A path tracer for spheres of fitted materials on a Lambertian plane, lit by an image from all around.
//
// It follows the text of a jaxbrdf.opencl.Collection, which defines
//
//     float3 material_eval(uint index, float3 wi, float3 wo, __global const float *parameters)
//
// and macros that experiments/trace_scene.py writes: SPHERES, the number of them; FLOOR, the albedo of the plane y = 0,
// if there is one; SKY_WIDTH and SKY_HEIGHT, the image's size; DEPTH, the most surfaces of a path; LIGHT_DRAWS and
// MATERIAL_DRAWS, how often (0 or 1) a direction is drawn by the light and by the material at each of them.
//
// The world has y up. A direction wi leaves a surface to the light, wo to the viewer, both in the surface's own frame
// with z the normal. Every object is convex and opaque: a ray that leaves one never meets it again, so it is left out
// of the search by its index, and no distance has to be kept.

#define NOTHING 0xffffffffu
#define PLANE SPHERES

// What all functions read.
typedef struct {
    __global const float4 *spheres;    // centre and radius
    __global const float *parameters;  // of the materials
    __global const float *radiance;    // linear Rec.709, SKY_HEIGHT x SKY_WIDTH x 3, the zenith's row first
    __global const float *rows;        // SKY_HEIGHT + 1 sums of the rows' probabilities
    __global const float *columns;     // SKY_HEIGHT x (SKY_WIDTH + 1), the same along each row
    __global const float *density;     // of each texel, 1/sr
} Scene;

typedef struct {
    float3 origin;
    float3 direction;
    uint left;  // the object that it leaves, or NOTHING
} Ray;

typedef struct {
    float distance;
    uint object;  // a sphere's index, PLANE or NOTHING
    float3 point;
    float3 normal;
} Hit;

typedef struct {
    uint object;
    float3 point;
    float3 tangent;
    float3 bitangent;
    float3 normal;
    float3 wo;
} Vertex;

// Random numbers

// Four hashes of four numbers: pcg4d of Jarzynski and Olano, Hash Functions for GPU Rendering (2020).
uint4 hash4(uint4 v) {
    v = v * 1664525u + 1013904223u;
    v += v.yzxy * v.wxyz;
    v ^= v >> 16u;
    v += v.yzxy * v.wxyz;
    return v;
}

// Four numbers in [0, 1) for one purpose (dimension) of a sample (its pixel, number and seed): 24 bits, so that none
// rounds to 1.
float4 uniform4(const uint4 sample, const uint dimension) {
    const uint4 bits = hash4((uint4)(sample.x, sample.y, dimension, sample.z)) >> 8u;
    return convert_float4(bits) * 0x1p-24f;
}

// Frames

// A surface's frame, the tangent eastwards about the y axis, as jaxbrdf's own renderer has it; x at the poles.
Vertex make_vertex(const Hit hit, const float3 backwards) {
    Vertex v = {hit.object, hit.point};
    const float length = sqrt(hit.normal.x * hit.normal.x + hit.normal.z * hit.normal.z);
    const float3 east = (float3)(hit.normal.z, 0.0f, -hit.normal.x);
    v.tangent = length > 0.0f ? east / length : (float3)(1.0f, 0.0f, 0.0f);
    v.bitangent = cross(hit.normal, v.tangent);
    v.normal = hit.normal;
    v.wo = (float3)(dot(v.tangent, backwards), dot(v.bitangent, backwards), dot(v.normal, backwards));
    return v;
}

float3 to_local(const Vertex *v, const float3 w) {
    return (float3)(dot(v->tangent, w), dot(v->bitangent, w), dot(v->normal, w));
}

float3 to_world(const Vertex *v, const float3 w) { return w.x * v->tangent + w.y * v->bitangent + w.z * v->normal; }

// Intersection

// The distance to a sphere from outside, INFINITY if it is missed. What the direction misses the centre by is found
// first, and the product of the roots instead of their difference: neither cancels when the sphere is far or near.
float sphere_distance(const float4 sphere, const Ray ray) {
    const float3 away = ray.origin - sphere.xyz;
    const float along = -dot(away, ray.direction);
    const float3 miss = away + along * ray.direction;
    const float squared = sphere.w * sphere.w - dot(miss, miss);
    if (along <= 0.0f || squared < 0.0f) return INFINITY;
    // a point of the plane where the sphere rests may be rounded into it
    return fmax(dot(away, away) - sphere.w * sphere.w, 0.0f) / (along + sqrt(squared));
}

float plane_distance(const Ray ray) {
#ifdef FLOOR
    return ray.direction.y < 0.0f ? fmax(ray.origin.y, 0.0f) / -ray.direction.y : INFINITY;
#else
    return INFINITY;
#endif
}

// The nearest object, its point and normal yet to be found.
Hit search(const Scene *scene, const Ray ray) {
    Hit hit = {INFINITY, NOTHING};
    for (uint i = 0; i <= SPHERES; ++i) {
        if (i == ray.left) continue;
        const float distance = i == PLANE ? plane_distance(ray) : sphere_distance(scene->spheres[i], ray);
        if (distance < hit.distance) {
            hit.distance = distance;
            hit.object = i;
        }
    }
    return hit;
}

Hit intersect(const Scene *scene, const Ray ray) {
    Hit hit = search(scene, ray);
    if (hit.object == NOTHING) return hit;
    hit.point = ray.origin + hit.distance * ray.direction;
    hit.normal = (float3)(0.0f, 1.0f, 0.0f);
    if (hit.object == PLANE) {
        hit.point.y = 0.0f;
    } else {
        const float4 sphere = scene->spheres[hit.object];
        hit.normal = normalize(hit.point - sphere.xyz);
        hit.point = sphere.xyz + sphere.w * hit.normal;
    }
    return hit;
}

// The sky: texel (0, 0) is at the zenith; at (u, v) from the left and the top, both in [0, 1], it shines from
// (sin t sin p, cos t, -sin t cos p) with t = pi v and p = 2 pi u, as in jaxbrdf/render/environment.py.

// A direction in texels: u SKY_WIDTH, v SKY_HEIGHT.
float2 sky_place(const float3 w) {
    const float u = atan2(w.x, -w.z) / (2.0f * M_PI_F);
    const float v = atan2(sqrt(w.x * w.x + w.z * w.z), w.y) / M_PI_F;
    return (float2)((u < 0.0f ? u + 1.0f : u) * SKY_WIDTH, v * SKY_HEIGHT);
}

float3 sky_texel(const Scene *scene, const int row, const int column) {
    const int inside = clamp(row, 0, SKY_HEIGHT - 1);
    const int around = (column + SKY_WIDTH) % SKY_WIDTH;
    __global const float *texel = scene->radiance + 3 * (inside * SKY_WIDTH + around);
    return (float3)(texel[0], texel[1], texel[2]);
}

// Radiance from a direction, bilinear between the texels' centres.
float3 sky(const Scene *scene, const float3 w) {
    const float2 at = sky_place(w) - 0.5f;
    const float2 low = floor(at);
    const float2 share = at - low;
    const int column = (int)low.x, row = (int)low.y;
    const float3 top = mix(sky_texel(scene, row, column), sky_texel(scene, row, column + 1), share.x);
    const float3 bottom = mix(sky_texel(scene, row + 1, column), sky_texel(scene, row + 1, column + 1), share.x);
    return mix(top, bottom, share.y);
}

// The density of `draw_sky` per solid angle.
float sky_density(const Scene *scene, const float3 w) {
    const float2 at = sky_place(w);
    const int column = min((int)at.x, SKY_WIDTH - 1), row = min((int)at.y, SKY_HEIGHT - 1);
    return scene->density[row * SKY_WIDTH + column];
}

// The last of `count` steps that begins at or below u, of sums that begin with 0 and end with 1: never an empty one.
uint find_step(__global const float *sums, const uint count, const float u) {
    uint low = 0, high = count;
    while (high - low > 1) {
        const uint middle = (low + high) / 2;
        if (sums[middle] <= u) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// A direction by brightness: a row, a texel in it, and evenly within the texel's solid angle, over which height and
// azimuth are even.
float3 draw_sky(const Scene *scene, const float4 u) {
    const uint row = find_step(scene->rows, SKY_HEIGHT, u.x);
    const uint column = find_step(scene->columns + row * (SKY_WIDTH + 1), SKY_WIDTH, u.y);
    const float y = mix(cospi((float)row / SKY_HEIGHT), cospi((row + 1.0f) / SKY_HEIGHT), u.z);
    const float turn = 2.0f * (column + u.w) / SKY_WIDTH, sine = sqrt(fmax(1.0f - y * y, 0.0f));
    return (float3)(sine * sinpi(turn), y, -sine * cospi(turn));
}

// The proposal: a bundle has no sampler of its own, so a direction is drawn from a cosine or from one of three GGX
// lobes, all equally often. The roughnesses are a factor of five apart: a lobe that is wider than the least is within
// about a factor of two of one of them. The plane is known to need the cosine alone.

#define LOBES 3
__constant float ROUGHNESS[LOBES] = {0.02f, 0.1f, 0.5f};

float3 draw_cosine(const float2 u) {
    const float radius = sqrt(u.y);
    return (float3)(radius * cospi(2.0f * u.x), radius * sinpi(2.0f * u.x), sqrt(1.0f - u.y));
}

// The mirror direction about a visible normal of GGX: Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical
// Caps (2023).
float3 draw_ggx(const float alpha, const float3 wo, const float2 u) {
    const float3 stretched = normalize((float3)(alpha * wo.x, alpha * wo.y, wo.z));
    const float z = (1.0f - u.y) * (1.0f + stretched.z) - stretched.z;
    const float sine = sqrt(clamp(1.0f - z * z, 0.0f, 1.0f));
    const float3 cap = (float3)(sine * cospi(2.0f * u.x), sine * sinpi(2.0f * u.x), z) + stretched;
    const float3 wh = normalize((float3)(alpha * cap.x, alpha * cap.y, cap.z));
    return 2.0f * dot(wo, wh) * wh - wo;
}

// Its density: G1(wo) D(wh) / (4 cos(wo)), in which the cosine cancels with that of Smith's G1.
float ggx_density(const float alpha, const float3 wi, const float3 wo) {
    const float a2 = alpha * alpha;
    const float3 wh = normalize(wi + wo);
    const float spread = wh.x * wh.x + wh.y * wh.y + a2 * wh.z * wh.z;
    const float g = wo.z + sqrt(a2 * (wo.x * wo.x + wo.y * wo.y) + wo.z * wo.z);
    return a2 / (2.0f * M_PI_F * spread * spread * g);
}

// A direction to the light for the viewer: u.x chooses the lobe. It may lie below the horizon.
float3 propose(const Vertex *v, const float4 u) {
    const int lobe = (int)(u.x * (LOBES + 1));
    return v->object == PLANE || lobe == LOBES ? draw_cosine(u.yz) : draw_ggx(ROUGHNESS[lobe], v->wo, u.yz);
}

// The density of `propose` at directions above the horizon, per solid angle of wi.
float proposal_density(const Vertex *v, const float3 wi) {
    float sum = wi.z / M_PI_F;
    if (v->object == PLANE) return sum;
    for (int i = 0; i < LOBES; ++i) sum += ggx_density(ROUGHNESS[i], wi, v->wo);
    return sum / (LOBES + 1);
}

// Transport

// f(wi, wo), 1/sr, without the cosine.
float3 reflectance(const Scene *scene, const Vertex *v, const float3 wi) {
#ifdef FLOOR
    if (v->object == PLANE) return (float3)(FLOOR / M_PI_F);
#endif
    return material_eval(v->object, wi, v->wo, scene->parameters);
}

// The power heuristic (Veach and Guibas 1995) for `own` draws where there are also `other`, both times their density:
// right for no draws of one kind, too.
float heuristic(const float own, const float other) {
    return own > 0.0f ? own * own / (own * own + other * other) : 0.0f;
}

// Radiance of the sky by way of the vertex, in a direction drawn by the light.
float3 by_light(const Scene *scene, const Vertex *v, const float4 u) {
    const float3 w = draw_sky(scene, u);
    const float3 wi = to_local(v, w);
    const float density = sky_density(scene, w);
    const Ray ray = {v->point, w, v->object};
    if (wi.z <= 0.0f || density <= 0.0f || search(scene, ray).object != NOTHING) return (float3)(0.0f);
    const float share = heuristic(LIGHT_DRAWS * density, MATERIAL_DRAWS * proposal_density(v, wi));
    return reflectance(scene, v, wi) * sky(scene, w) * (wi.z / density * share);
}

// Radiance against a camera ray of at most DEPTH surfaces. A path goes on with the probability of its throughput.
float3 trace(const Scene *scene, Ray ray, const uint4 sample) {
    Hit hit = intersect(scene, ray);
    if (hit.object == NOTHING) return sky(scene, ray.direction);
    float3 colour = (float3)(0.0f), throughput = (float3)(1.0f);
    for (uint depth = 0; depth < DEPTH; ++depth) {
        const Vertex v = make_vertex(hit, -ray.direction);
        if (LIGHT_DRAWS) colour += throughput * by_light(scene, &v, uniform4(sample, 2 * depth + 1));
        const float4 u = uniform4(sample, 2 * depth + 2);
        const float3 wi = propose(&v, u);
        if (wi.z <= 0.0f || v.wo.z <= 0.0f) break;
        const float density = proposal_density(&v, wi);
        throughput *= reflectance(scene, &v, wi) * (wi.z / density);
        ray = (Ray){v.point, to_world(&v, wi), v.object};
        hit = intersect(scene, ray);
        if (hit.object == NOTHING) {
            const float share = heuristic(MATERIAL_DRAWS * density, LIGHT_DRAWS * sky_density(scene, ray.direction));
            colour += throughput * sky(scene, ray.direction) * share;
            break;
        }
        const float survival = fmin(fmax(throughput.x, fmax(throughput.y, throughput.z)), 1.0f);
        if (u.w >= survival) break;
        throughput /= survival;
    }
    return colour;
}

// A sample beyond this comes of an overflow, and a million of them still add up to a number.
#define LARGEST 1e30f

// Adds one sample to each pixel: the sum of colours, and in w their number. What is NaN or beyond LARGEST does not
// count.
//
// camera: its place, then the directions to the right, up and to the picture's centre, the first two as long as half
// the picture is wide and high at the distance of the third. number: of the sample, from 0.
__kernel void add_sample(
    __global float4 *sums, __constant float4 *camera, __global const float4 *spheres, __global const float *parameters,
    __global const float *radiance, __global const float *rows, __global const float *columns,
    __global const float *density, const uint number, const uint seed) {
    const Scene scene = {spheres, parameters, radiance, rows, columns, density};
    const uint column = get_global_id(0), row = get_global_id(1), width = get_global_size(0);
    const uint pixel = row * width + column;
    const uint4 sample = (uint4)(pixel, number, seed, 0u);
    const float4 u = uniform4(sample, 0);
    const float x = 2.0f * (column + u.x) / width - 1.0f, y = 1.0f - 2.0f * (row + u.y) / get_global_size(1);
    const float3 towards = camera[3].xyz + x * camera[1].xyz + y * camera[2].xyz;
    const Ray ray = {camera[0].xyz, normalize(towards), NOTHING};
    const float3 colour = trace(&scene, ray, sample);
    if (colour.x + colour.y + colour.z <= LARGEST) sums[pixel] += (float4)(colour, 1.0f);
}
