/* Drives whose friction follows one of the published laws.
 *
 * The unknown of a sample is the elastic torque e. The output's angle x(e) rises with it:
 *
 *   x(e) = c e (1 - h u^2 / (1 + u^2)) + gap e / sqrt(e^2 + knee^2),   u = e / rated
 *
 * with a knee much smaller than any torque of the recordings this is a dead zone. Friction is
 * driven by x and acts beside the elasticity, e + F(x) = T. Every law is advanced from sample to
 * sample by its exact solution over a monotone move, so the length of a step does not matter.
 */
#include <math.h>
#include <stddef.h>

enum { MAXWELL, DAHL, LUGRE, BOUC_WEN };
enum { ELEMENTS_MAX = 8, HALVINGS = 200 };
static const double widest_share = 40.0; /* of the rated torque, bracket of the elastic torque */

typedef struct {
  int law;
  int elements; /* of Maxwell; 1 otherwise */
  double rated_torque_Nm;
  double compliance_rad_per_Nm;
  double hardening;  /* share of the compliance that vanishes far beyond rated torque */
  double asymmetry;  /* compliance of the negative side over that of the positive one, less 1 */
  double knee_Nm;    /* torque at which most of the gap is taken up */
  double load_share; /* growth of the friction limits with the elastic torque, N m per N m */
  double stribeck;   /* static over sliding friction, less 1 (LuGre) */
  double stribeck_rad_per_s;
  double viscous_Nms_per_rad;
  double limit_Nm[ELEMENTS_MAX];
  double angle_rad[ELEMENTS_MAX]; /* wind-up of the contacts at the limit, from rest */
} law_drive;

typedef struct {
  const double *torque_Nm;
  const double *gap_rad;
  const double *compliance; /* factor */
  const double *friction;   /* factor of the limits */
  const double *step_s;     /* 0 at a run's start */
} law_samples;

typedef struct {
  double angle_rad;
  double force_Nm[ELEMENTS_MAX];
} law_memory;

static double angle_of(const law_drive *d, const law_samples *s, size_t n, double e) {
  const double u = e / d->rated_torque_Nm, side = e < 0.0 ? -1.0 : 1.0;
  const double soft = 1.0 - d->hardening * u * u / (1.0 + u * u);
  return d->compliance_rad_per_Nm * s->compliance[n] * (1.0 - 0.5 * side * d->asymmetry) * e *
             soft +
         s->gap_rad[n] * e / sqrt(e * e + d->knee_Nm * d->knee_Nm);
}

/* Force of an element after a monotone move by dx from force f. */
static double moved(const law_drive *d, double f, double limit, double stiffness, double dx,
                    double step_s) {
  const double sign = dx < 0.0 ? -1.0 : 1.0;
  double force;
  switch (d->law) {
    case DAHL:
      return sign * limit - (sign * limit - f) * exp(-stiffness * fabs(dx) / limit);
    case LUGRE: {
      const double speed = step_s > 0.0 ? fabs(dx) / step_s : 0.0;
      const double ratio = speed / d->stribeck_rad_per_s;
      const double level = limit * (1.0 + d->stribeck * exp(-ratio * ratio));
      return sign * level - (sign * level - f) * exp(-stiffness * fabs(dx) / level);
    }
    case BOUC_WEN: { /* exponent 2, beta = gamma: z' = A unloading, A (1 - (z/limit)^2) loading */
      double left = fabs(dx), z = sign * f;
      if (z < 0.0) {
        const double needed = -z / stiffness;
        if (left <= needed) {
          return sign * (z + stiffness * left);
        }
        left -= needed;
        z = 0.0;
      }
      if (z >= limit) {
        return sign * limit;
      }
      return sign * limit * tanh(atanh(z / limit) + stiffness * left / limit);
    }
    default:
      force = f + stiffness * dx;
      return force > limit ? limit : force < -limit ? -limit : force;
  }
}

static double friction_at(const law_drive *d, const law_samples *s, size_t n,
                          const law_memory *memory, double e, double x, double *forces) {
  double sum = 0.0;
  int i;
  for (i = 0; i < d->elements; ++i) {
    const double limit = s->friction[n] * (d->limit_Nm[i] + d->load_share * fabs(e) / d->elements);
    const double stiffness = s->friction[n] * d->limit_Nm[i] / d->angle_rad[i];
    const double dx = x - memory->angle_rad;
    forces[i] = moved(d, memory->force_Nm[i], limit, stiffness, dx, s->step_s[n]);
    sum += forces[i];
    if (d->law == LUGRE && s->step_s[n] > 0.0) {
      sum += d->viscous_Nms_per_rad * dx / s->step_s[n];
    }
  }
  return sum;
}

/* Turns the drive through all samples by bisection; returns angle and elastic torque. */
void law_turn(const law_drive *d, const law_samples *s, size_t count, law_memory *memory,
              double *angle_rad, double *elastic_torque_Nm) {
  size_t n;
  for (n = 0; n < count; ++n) {
    double low = -widest_share * d->rated_torque_Nm, high = -low, e = 0.0, x = 0.0;
    double forces[ELEMENTS_MAX];
    int i;
    for (i = 0; i < HALVINGS; ++i) {
      e = 0.5 * (low + high);
      x = angle_of(d, s, n, e);
      if (e + friction_at(d, s, n, memory, e, x, forces) > s->torque_Nm[n]) {
        high = e;
      } else {
        low = e;
      }
      if (high - low < 1e-12 * d->rated_torque_Nm) {
        break;
      }
    }
    for (i = 0; i < d->elements; ++i) {
      memory->force_Nm[i] = forces[i];
    }
    memory->angle_rad = x;
    angle_rad[n] = x;
    elastic_torque_Nm[n] = e;
  }
}
