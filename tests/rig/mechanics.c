/* Mechanics of the rig: a drive turned by a torque, its friction in parallel with its elasticity.
 *
 * The state of a drive is the mesh angle m, by which the tooth pairs of one side are pressed
 * together. Everything else follows from it: the pairs in contact carry the elastic torque Te(m);
 * the radial parts, the torsion spring, the joint and the radial gap yield under Te and add up to
 * the output's angle x(m); each Maxwell element sticks to x until it slips. The solver finds the m
 * at each sample at which all this balances the acting torque
 *
 *   Te(m) + sum F_i(x(m)) + J x'' = T.
 *
 * The left side never falls with m, so the root is bracketed and found by Newton steps with
 * bisection as a fallback. A Maxwell element's force after a monotone move is clip(F + k dx, -W, W)
 * for any length of the move: there is no step-size error, and small cycles close.
 */
#include <math.h>
#include <stddef.h>

enum { SLIPS_MAX = 16 };
static const double angle_resolution_rad = 1e-11;
static const double widest_angle_rad = 0.1;
enum { NEWTON_STEPS_MAX = 20, ITERATIONS_MAX = 100 };

typedef struct {
  int pairs; /* tooth pairs a side */
  int slips; /* Maxwell elements, at most SLIPS_MAX */
  /* Per side (0 for positive torque, 1 for negative), by rising gap: where pair i meets, and the
     sums of stiffness and of stiffness times gap over the pairs up to it. */
  const double *gap_rad[2];
  const double *stiffness_sum[2];
  const double *offset_sum[2];
  const double *slip_stiffness_Nm_per_rad;
  const double *slip_limit_Nm;
  double rated_torque_Nm;
  double radial_rad;      /* radial power law at rated torque */
  double radial_exponent; /* of the torque, beyond the preload */
  double radial_preload;  /* share of the rated torque below which it is linear */
  double torsion_rad;     /* wind-up of the torsion spring at rated torque */
  double knee_Nm;         /* torque at which most of the radial gap is taken up */
  double load_friction;   /* growth of every slip limit at rated torque, as a share */
  double joint_rad;       /* joint that opens early: its final angle */
  double joint_torque_Nm;
  double hardening;    /* the torsion spring gets stiffer at 1/this of the rated torque */
  double asymmetry;    /* compliance of the negative side over that of the positive one, less 1 */
  double inertia_kgm2; /* between the torque sensor and the drive */
} rig_drive;

typedef struct {
  const double *torque_Nm;
  const double *gap_rad;    /* radial gap */
  const double *compliance; /* factor of mesh, radial parts and torsion */
  const double *friction;   /* factor of the slip limits */
  const double *play_rad;   /* free play in the mesh, half its width */
  const double *lobe_rad;   /* mesh angle by which one lobe leads and the other lags */
  const double *step_s;     /* time since the sample before; 0 at a run's start */
} rig_samples;

typedef struct {
  double angle_rad;
  double slip_Nm[SLIPS_MAX];
  double mesh_rad;
} rig_memory;

typedef struct {
  double torque, torque_slope;   /* elastic, over the mesh angle */
  double angle, angle_slope;     /* output, over the mesh angle */
  double elastic_angle;          /* share of the angle that the compliance factor scales */
  double balance, balance_slope; /* sum of torques */
} balance_at;

static void take_up(const rig_drive *d, double mesh, double play, double *torque, double *slope) {
  const int side = mesh < 0.0;
  const double pressed = fabs(mesh) - play;
  const double *gap = d->gap_rad[side];
  int low = 0, high = d->pairs;
  if (!(pressed > 0.0)) {
    return;
  }
  while (low < high) {
    const int middle = (low + high) / 2;
    if (gap[middle] < pressed) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low > 0) {
    const double stiffness = d->stiffness_sum[side][low - 1];
    const double carried = stiffness * pressed - d->offset_sum[side][low - 1];
    *torque += 0.5 * (side ? -carried : carried);
    *slope += 0.5 * stiffness;
  }
}

static balance_at evaluate(const rig_drive *d, const rig_samples *s, size_t n,
                           const rig_memory *memory, double before_rad, double mesh) {
  balance_at at = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const double lobe = s->lobe_rad[n], play = s->play_rad[n], gap = s->gap_rad[n];
  double share, side, soft, power, scale, give, slope, hard, joint, knee, limit;
  int i;
  take_up(d, mesh + lobe, play, &at.torque, &at.torque_slope);
  take_up(d, mesh - lobe, play, &at.torque, &at.torque_slope);
  share = at.torque / d->rated_torque_Nm;
  side = mesh < 0.0 ? -1.0 : 1.0;

  soft = d->radial_preload * d->radial_preload + share * share;
  power = pow(soft, 0.5 * (d->radial_exponent - 1.0));
  give = d->radial_rad * share * power;
  slope = d->radial_rad * power * (1.0 + (d->radial_exponent - 1.0) * share * share / soft);
  if (d->hardening > 0.0) {
    hard = d->hardening * share;
    give += d->torsion_rad * asinh(hard) / d->hardening;
    slope += d->torsion_rad / sqrt(1.0 + hard * hard);
  } else {
    give += d->torsion_rad * share;
    slope += d->torsion_rad;
  }
  scale = s->compliance[n] * (1.0 - 0.5 * side * d->asymmetry);
  at.elastic_angle = scale * (mesh + give);
  at.angle = at.elastic_angle;
  at.angle_slope = scale * (1.0 + slope * at.torque_slope / d->rated_torque_Nm);

  knee = sqrt(at.torque * at.torque + d->knee_Nm * d->knee_Nm);
  at.angle += gap * at.torque / knee;
  at.angle_slope += gap * d->knee_Nm * d->knee_Nm / (knee * knee * knee) * at.torque_slope;
  joint = exp(-fabs(at.torque) / d->joint_torque_Nm);
  at.angle += side * d->joint_rad * (1.0 - joint);
  at.angle_slope += d->joint_rad * joint / d->joint_torque_Nm * at.torque_slope;

  at.balance = at.torque - s->torque_Nm[n];
  at.balance_slope = at.torque_slope;
  for (i = 0; i < d->slips; ++i) {
    double force =
        memory->slip_Nm[i] + d->slip_stiffness_Nm_per_rad[i] * (at.angle - memory->angle_rad);
    limit = d->slip_limit_Nm[i] * s->friction[n] * (1.0 + d->load_friction * fabs(share));
    if (force > limit) {
      force = limit;
    } else if (force < -limit) {
      force = -limit;
    } else {
      at.balance_slope += d->slip_stiffness_Nm_per_rad[i] * at.angle_slope;
    }
    at.balance += force;
  }
  if (d->inertia_kgm2 > 0.0 && s->step_s[n] > 0.0) {
    const double reaction = d->inertia_kgm2 / (s->step_s[n] * s->step_s[n]);
    at.balance += reaction * (at.angle - 2.0 * memory->angle_rad + before_rad);
    at.balance_slope += reaction * at.angle_slope;
  }
  return at;
}

/* Turns the drive through all samples; returns the first one without equilibrium, or the count. */
size_t rig_turn(const rig_drive *d, const rig_samples *s, size_t count, rig_memory *memory,
                double *angle_rad, double *elastic_angle_rad, double *elastic_torque_Nm) {
  double before = memory->angle_rad;
  size_t n;
  for (n = 0; n < count; ++n) {
    double low = -widest_angle_rad, high = widest_angle_rad, mesh = memory->mesh_rad;
    balance_at at;
    int i;
    at = evaluate(d, s, n, memory, before, mesh);
    for (i = 0; i < ITERATIONS_MAX; ++i) {
      double next;
      if (at.balance == 0.0) {
        break;
      }
      if (at.balance > 0.0) {
        high = mesh;
      } else {
        low = mesh;
      }
      next = mesh - at.balance / at.balance_slope;
      if (i > NEWTON_STEPS_MAX || !(next > low && next < high)) {
        next = 0.5 * (low + high);
      }
      if (fabs(next - mesh) < angle_resolution_rad) {
        mesh = next;
        at = evaluate(d, s, n, memory, before, mesh);
        break;
      }
      mesh = next;
      at = evaluate(d, s, n, memory, before, mesh);
    }
    if (i == ITERATIONS_MAX || fabs(mesh) > 0.99 * widest_angle_rad) {
      return n;
    }
    for (i = 0; i < d->slips; ++i) {
      const double limit = d->slip_limit_Nm[i] * s->friction[n] *
                           (1.0 + d->load_friction * fabs(at.torque / d->rated_torque_Nm));
      const double force =
          memory->slip_Nm[i] + d->slip_stiffness_Nm_per_rad[i] * (at.angle - memory->angle_rad);
      memory->slip_Nm[i] = force > limit ? limit : force < -limit ? -limit : force;
    }
    /* A recording starts at rest: the drive was loaded slowly before it. */
    before = s->step_s[n] > 0.0 ? memory->angle_rad : at.angle;
    memory->angle_rad = at.angle;
    memory->mesh_rad = mesh;
    angle_rad[n] = at.angle;
    elastic_angle_rad[n] = at.elastic_angle;
    elastic_torque_Nm[n] = at.torque;
  }
  return count;
}
