// Interface of a peer in C++: seven functions, prefixed with the name of the peer.
// The Rust side is src/native.rs; the two structs must have the same layout there.
#pragma once

#include <cstdint>

// Copies of one body, each moved by its offset. Units are meters, kilograms and seconds.
struct PeerScene
{
    const float *positions;       // 3 for each particle
    const float *inverse_masses;  // 1 for each particle; 0 is pinned
    const uint32_t *edges;        // 2 for each edge
    const uint32_t *tetrahedra;   // 4 for each tetrahedron
    const uint32_t *triangles;    // 3 for each triangle of the surface
    const float *offsets;         // 3 for each body
    const float *volume_compliances;  // 1 for each tetrahedron [m^5/N]; null if all are rigid
    uint32_t particle_count;
    uint32_t edge_count;
    uint32_t tetrahedron_count;
    uint32_t triangle_count;
    uint32_t body_count;
    uint32_t substeps;            // of a tick
    uint32_t threads;
    float edge_compliance;        // [m/N]
    float edge_softness;          // α/h² over the mean inverse mass
    float gravity;                // along y [m/s²]
    // Jolt only, in its units; Bullet also has the damping.
    const uint32_t *hinges;       // 4 for each hinge, its edge first
    uint32_t hinge_count;
    float hinge_compliance;       // [1/(N·m)]
    float pressure;               // [J]
    float linear_damping;         // [1/s]
    float gravity_factor;
};

// Number of constraints in the peer after the scene was built, over all bodies.
struct PeerCounts
{
    uint64_t edges;
    uint64_t tetrahedra;
};

#define PEER_DECLARE(name)                                                  \
    extern "C"                                                              \
    {                                                                       \
        const char *name##_version();                                       \
        void *name##_create(const PeerScene *scene);                        \
        void name##_destroy(void *world);                                   \
        void name##_tick(void *world, float seconds);                       \
        PeerCounts name##_counts(const void *world);                        \
        void name##_positions(const void *world, float *positions);         \
        uint32_t name##_particles(const void *world);                       \
    }
