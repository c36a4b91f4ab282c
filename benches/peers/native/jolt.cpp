// Jolt's soft bodies with the functions of peer.h.
//
// A body is stepped by PhysicsSystem::Update, as in a game. Jolt uses its number of iterations as
// the number of substeps. Besides, jolt_place moves the particles.

#include <Jolt/Jolt.h>

#include <Jolt/ConfigurationString.h>
#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/JobSystemThreadPool.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyLock.h>
#include <Jolt/Physics/PhysicsSettings.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/Physics/SoftBody/SoftBodyCreationSettings.h>
#include <Jolt/Physics/SoftBody/SoftBodyMotionProperties.h>
#include <Jolt/Physics/SoftBody/SoftBodySharedSettings.h>
#include <Jolt/RegisterTypes.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "peer.h"

PEER_DECLARE(jolt)

// Moves the movable particles to these positions, 3 for each particle, without velocity.
extern "C" void jolt_place(void *world, const float *positions);

using namespace JPH;

namespace {

// One layer without collisions.
class OneLayer final : public BroadPhaseLayerInterface
{
public:
    uint GetNumBroadPhaseLayers() const override { return 1; }
    BroadPhaseLayer GetBroadPhaseLayer(ObjectLayer) const override { return BroadPhaseLayer(0); }
};

class NothingMeetsLayers final : public ObjectVsBroadPhaseLayerFilter
{
public:
    bool ShouldCollide(ObjectLayer, BroadPhaseLayer) const override { return false; }
};

class NothingMeets final : public ObjectLayerPairFilter
{
public:
    bool ShouldCollide(ObjectLayer, ObjectLayer) const override { return false; }
};

struct World
{
    OneLayer layers;
    NothingMeetsLayers layer_filter;
    NothingMeets pair_filter;
    TempAllocatorImplWithMallocFallback memory { 64 * 1024 * 1024 };
    std::unique_ptr<JobSystem> jobs;
    Ref<SoftBodySharedSettings> shared;
    PhysicsSystem system;
    std::vector<BodyID> bodies;
};

void set_up_once()
{
    static std::once_flag once;
    std::call_once(once, [] {
        RegisterDefaultAllocator();
        Factory::sInstance = new Factory();
        RegisterTypes();
    });
}

Ref<SoftBodySharedSettings> shared_settings(const PeerScene &scene)
{
    Ref<SoftBodySharedSettings> shared = new SoftBodySharedSettings;
    for (uint32 i = 0; i < scene.particle_count; ++i) {
        const float *p = scene.positions + 3 * i;
        shared->mVertices.emplace_back(
            Float3(p[0], p[1], p[2]), Float3(0, 0, 0), scene.inverse_masses[i]);
    }
    for (uint32 i = 0; i < scene.edge_count; ++i) {
        const uint32 *e = scene.edges + 2 * i;
        shared->mEdgeConstraints.emplace_back(e[0], e[1], scene.edge_compliance);
    }
    for (uint32 i = 0; i < scene.tetrahedron_count; ++i) {
        const uint32 *t = scene.tetrahedra + 4 * i;
        // Jolt's constraint is six times the volume.
        const float compliance
            = scene.volume_compliances ? 36.0f * scene.volume_compliances[i] : 0.0f;
        shared->mVolumeConstraints.emplace_back(t[0], t[1], t[2], t[3], compliance);
    }
    for (uint32 i = 0; i < scene.triangle_count; ++i) {
        const uint32 *f = scene.triangles + 3 * i;
        shared->AddFace(SoftBodySharedSettings::Face(f[0], f[1], f[2]));
    }
    for (uint32 i = 0; i < scene.hinge_count; ++i) {
        const uint32 *v = scene.hinges + 4 * i;
        shared->mDihedralBendConstraints.emplace_back(
            v[0], v[1], v[2], v[3], scene.hinge_compliance);
    }
    shared->CalculateEdgeLengths();
    shared->CalculateVolumeConstraintVolumes();
    shared->CalculateBendConstraintConstants();
    shared->Optimize();
    return shared;
}

const SoftBodyMotionProperties *motion_of(const World &world, const BodyID &id, RVec3 *centre)
{
    const Body *body = world.system.GetBodyLockInterfaceNoLock().TryGetBody(id);
    *centre = body->GetCenterOfMassPosition();
    return static_cast<const SoftBodyMotionProperties *>(body->GetMotionProperties());
}

} // namespace

const char *jolt_version()
{
    static const std::string version = std::to_string(JPH_VERSION_MAJOR) + "."
        + std::to_string(JPH_VERSION_MINOR) + "." + std::to_string(JPH_VERSION_PATCH) + " ("
        + GetConfigurationString() + "compiler " __VERSION__ ")";
    return version.c_str();
}

void *jolt_create(const PeerScene *scene)
{
    set_up_once();
    auto *world = new World;
    if (scene->threads > 1)
        world->jobs = std::make_unique<JobSystemThreadPool>(
            cMaxPhysicsJobs, cMaxPhysicsBarriers, int(scene->threads) - 1);
    else
        world->jobs = std::make_unique<JobSystemSingleThreaded>(cMaxPhysicsJobs);
    const uint bodies = scene->body_count;
    world->system.Init(
        bodies, 0, 1, 1, world->layers, world->layer_filter, world->pair_filter);
    world->system.SetGravity(Vec3(0, scene->gravity, 0));
    world->shared = shared_settings(*scene);
    for (uint i = 0; i < bodies; ++i) {
        const float *offset = scene->offsets + 3 * i;
        SoftBodyCreationSettings settings(
            world->shared, RVec3(offset[0], offset[1], offset[2]), Quat::sIdentity(), 0);
        settings.mNumIterations = scene->substeps;
        settings.mLinearDamping = scene->linear_damping;
        settings.mGravityFactor = scene->gravity_factor;
        settings.mPressure = scene->pressure;
        settings.mMaxLinearVelocity = 1.0e6f;
        settings.mAllowSleeping = false;
        world->bodies.push_back(world->system.GetBodyInterfaceNoLock().CreateAndAddSoftBody(
            settings, EActivation::Activate));
    }
    world->system.OptimizeBroadPhase();
    return world;
}

void jolt_destroy(void *world)
{
    auto *w = static_cast<World *>(world);
    BodyInterface &bodies = w->system.GetBodyInterfaceNoLock();
    for (const BodyID &id : w->bodies) {
        bodies.RemoveBody(id);
        bodies.DestroyBody(id);
    }
    delete w;
}

void jolt_tick(void *world, float seconds)
{
    auto *w = static_cast<World *>(world);
    w->system.Update(seconds, 1, &w->memory, w->jobs.get());
}

PeerCounts jolt_counts(const void *world)
{
    const auto *w = static_cast<const World *>(world);
    PeerCounts counts {};
    for (const BodyID &id : w->bodies) {
        RVec3 centre;
        const SoftBodySharedSettings *settings = motion_of(*w, id, &centre)->GetSettings();
        counts.edges += settings->mEdgeConstraints.size();
        counts.tetrahedra += settings->mVolumeConstraints.size();
    }
    return counts;
}

void jolt_positions(const void *world, float *positions)
{
    const auto *w = static_cast<const World *>(world);
    for (const BodyID &id : w->bodies) {
        RVec3 centre;
        for (const SoftBodyMotionProperties::Vertex &vertex :
             motion_of(*w, id, &centre)->GetVertices()) {
            const RVec3 x = centre + vertex.mPosition;
            *positions++ = float(x.GetX());
            *positions++ = float(x.GetY());
            *positions++ = float(x.GetZ());
        }
    }
}

uint32_t jolt_particles(const void *world)
{
    const auto *w = static_cast<const World *>(world);
    uint32_t particles = 0;
    for (const BodyID &id : w->bodies) {
        RVec3 centre;
        particles += uint32_t(motion_of(*w, id, &centre)->GetVertices().size());
    }
    return particles;
}

void jolt_place(void *world, const float *positions)
{
    auto *w = static_cast<World *>(world);
    const BodyLockInterface &bodies = w->system.GetBodyLockInterfaceNoLock();
    for (const BodyID &id : w->bodies) {
        Body *body = bodies.TryGetBody(id);
        const RVec3 centre = body->GetCenterOfMassPosition();
        auto *motion = static_cast<SoftBodyMotionProperties *>(body->GetMotionProperties());
        for (SoftBodyMotionProperties::Vertex &vertex : motion->GetVertices()) {
            const RVec3 x(positions[0], positions[1], positions[2]);
            positions += 3;
            if (vertex.mInvMass > 0.0f)
                vertex.mPosition = Vec3(x - centre);
            vertex.mPreviousPosition = vertex.mPosition;
            vertex.mVelocity = Vec3::sZero();
        }
    }
}
