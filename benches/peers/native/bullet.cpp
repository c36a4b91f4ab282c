// Bullet's soft bodies with the functions of peer.h. Links only: its position-based solver has no
// volume of a tetrahedron.
//
// A substep performs the work of btDefaultSoftBodySolver on a body in one step, without the
// collision world, with one position iteration and no velocity iterations.

#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyInternals.h>

#include <memory>
#include <string>
#include <vector>

#include "peer.h"

PEER_DECLARE(bullet)

namespace {

struct World
{
    btSoftBodyWorldInfo info;
    std::vector<std::unique_ptr<btSoftBody>> bodies;
    uint32_t substeps = 1;
};

std::unique_ptr<btSoftBody> body_of(const PeerScene &scene, World &world, const float *offset)
{
    std::vector<btVector3> positions;
    std::vector<btScalar> masses;
    for (uint32_t i = 0; i < scene.particle_count; ++i) {
        const float *p = scene.positions + 3 * i;
        positions.emplace_back(p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]);
        const float weight = scene.inverse_masses[i];
        masses.push_back(weight > 0 ? 1 / weight : 0);
    }
    auto body = std::make_unique<btSoftBody>(
        &world.info, int(positions.size()), positions.data(), masses.data());
    // Fraction of the error that a projection of a link between two mean masses removes, with the
    // compliance of the scene.
    body->m_materials[0]->m_kLST = 2 / (2 + scene.edge_softness);
    for (uint32_t i = 0; i < scene.edge_count; ++i)
        body->appendLink(int(scene.edges[2 * i]), int(scene.edges[2 * i + 1]));
    // Fraction of the velocity that a substep removes.
    const float damping = scene.linear_damping / (60.0f * float(scene.substeps));
    body->m_cfg.kDP = damping / (1 + damping);
    body->m_cfg.piterations = 1;
    body->m_cfg.viterations = 0;
    body->m_cfg.diterations = 0;
    body->m_cfg.citerations = 0;
    body->m_cfg.collisions = 0;
    btSoftBodyHelpers::ReoptimizeLinkOrder(body.get());
    return body;
}

} // namespace

const char *bullet_version()
{
    static const std::string version = std::to_string(BT_BULLET_VERSION / 100) + "."
        + std::to_string(BT_BULLET_VERSION % 100);
    return version.c_str();
}

void *bullet_create(const PeerScene *scene)
{
    auto *world = new World;
    world->info.air_density = 0;
    world->info.m_gravity = btVector3(0, scene->gravity, 0);
    world->info.m_maxDisplacement = 1.0e6f;
    world->substeps = scene->substeps;
    for (uint32_t i = 0; i < scene->body_count; ++i)
        world->bodies.push_back(body_of(*scene, *world, scene->offsets + 3 * i));
    return world;
}

void bullet_destroy(void *world)
{
    delete static_cast<World *>(world);
}

void bullet_tick(void *world, float seconds)
{
    auto *w = static_cast<World *>(world);
    const btScalar h = seconds / btScalar(w->substeps);
    for (auto &body : w->bodies) {
        for (uint32_t i = 0; i < w->substeps; ++i) {
            body->predictMotion(h);
            body->solveConstraints();
        }
        body->integrateMotion();
    }
}

PeerCounts bullet_counts(const void *world)
{
    PeerCounts counts {};
    for (const auto &body : static_cast<const World *>(world)->bodies)
        counts.edges += uint64_t(body->m_links.size());
    return counts;
}

void bullet_positions(const void *world, float *positions)
{
    for (const auto &body : static_cast<const World *>(world)->bodies)
        for (int i = 0; i < body->m_nodes.size(); ++i)
            for (int axis = 0; axis < 3; ++axis)
                *positions++ = float(body->m_nodes[i].m_x[axis]);
}

uint32_t bullet_particles(const void *world)
{
    uint32_t particles = 0;
    for (const auto &body : static_cast<const World *>(world)->bodies)
        particles += uint32_t(body->m_nodes.size());
    return particles;
}
