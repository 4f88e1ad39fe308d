/* A number with its derivatives in LM_LANES directions, in place of lm_real
 * (LM_REAL_HEADER of lostmotion/real.h): the design model's own source, compiled once more as C++,
 * then gives its results together with their exact derivatives.
 *
 * Comparisons, floor and conversions to integers use only the value: at a kink the derivative
 * is that of the branch that the value takes.
 */
#ifndef LOSTMOTION_OPTIMIZER_DUAL_H
#define LOSTMOTION_OPTIMIZER_DUAL_H

#include <math.h>
#include <stddef.h>

/* Names of this instance of the model (derivatives.cpp). */
#define LM_NUMBER_SPACE lm_with_slopes
#define LM_NUMBER_SIZE lm_dual_workspace_size
#define LM_NUMBER_EVALUATE lm_dual_evaluate

/* Directions of one pass. Eight fill the vector registers of every target; more variables require
 * more passes. */
#define LM_LANES 8

class lm_dual {
 public:
  lm_dual() = default;
  template <class number>
  explicit lm_dual(number plain) : value_(static_cast<double>(plain)) {
    for (int i = 0; i < LM_LANES; i++) {
      slope_[i] = 0.0;
    }
  }

  double value() const {
    return value_;
  }
  double slope(int lane) const {
    return slope_[lane];
  }
  void set_slope(int lane, double slope) {
    slope_[lane] = slope;
  }
  explicit operator int() const {
    return static_cast<int>(value_);
  }

  lm_dual operator-() const {
    lm_dual result;
    result.value_ = -value_;
    for (int i = 0; i < LM_LANES; i++) {
      result.slope_[i] = -slope_[i];
    }
    return result;
  }
  lm_dual &operator+=(const lm_dual &b) {
    value_ += b.value_;
    for (int i = 0; i < LM_LANES; i++) {
      slope_[i] += b.slope_[i];
    }
    return *this;
  }
  lm_dual &operator-=(const lm_dual &b) {
    value_ -= b.value_;
    for (int i = 0; i < LM_LANES; i++) {
      slope_[i] -= b.slope_[i];
    }
    return *this;
  }
  lm_dual &operator*=(const lm_dual &b) {
    for (int i = 0; i < LM_LANES; i++) {
      slope_[i] = slope_[i] * b.value_ + value_ * b.slope_[i];
    }
    value_ *= b.value_;
    return *this;
  }
  lm_dual &operator/=(const lm_dual &b) {
    const double quotient = value_ / b.value_;
    for (int i = 0; i < LM_LANES; i++) {
      slope_[i] = (slope_[i] - quotient * b.slope_[i]) / b.value_;
    }
    value_ = quotient;
    return *this;
  }

  /* f(a) from f's value and derivative there. */
  static lm_dual chain(const lm_dual &a, double value, double derivative) {
    lm_dual result;
    result.value_ = value;
    for (int i = 0; i < LM_LANES; i++) {
      result.slope_[i] = derivative * a.slope_[i];
    }
    return result;
  }

 private:
  /* Aligned for vector registers, as far as malloc aligns: without it a search over a double arc
   * takes a fifth longer. */
  alignas(max_align_t) double slope_[LM_LANES];
  double value_;
};

typedef lm_dual lm_real;

inline lm_dual operator+(lm_dual a, const lm_dual &b) {
  return a += b;
}
inline lm_dual operator-(lm_dual a, const lm_dual &b) {
  return a -= b;
}
inline lm_dual operator*(lm_dual a, const lm_dual &b) {
  return a *= b;
}
inline lm_dual operator/(lm_dual a, const lm_dual &b) {
  return a /= b;
}
inline bool operator<(const lm_dual &a, const lm_dual &b) {
  return a.value() < b.value();
}
inline bool operator>(const lm_dual &a, const lm_dual &b) {
  return a.value() > b.value();
}
inline bool operator<=(const lm_dual &a, const lm_dual &b) {
  return a.value() <= b.value();
}
inline bool operator>=(const lm_dual &a, const lm_dual &b) {
  return a.value() >= b.value();
}
inline bool operator==(const lm_dual &a, const lm_dual &b) {
  return a.value() == b.value();
}
inline bool operator!=(const lm_dual &a, const lm_dual &b) {
  return a.value() != b.value();
}

inline lm_dual real_sin(const lm_dual &a) {
  return lm_dual::chain(a, sin(a.value()), cos(a.value()));
}
inline lm_dual real_cos(const lm_dual &a) {
  return lm_dual::chain(a, cos(a.value()), -sin(a.value()));
}
inline lm_dual real_tan(const lm_dual &a) {
  const double t = tan(a.value());
  return lm_dual::chain(a, t, 1.0 + t * t);
}
inline lm_dual real_atan(const lm_dual &a) {
  return lm_dual::chain(a, atan(a.value()), 1.0 / (1.0 + a.value() * a.value()));
}
inline lm_dual real_acos(const lm_dual &a) {
  const double v = a.value();
  return lm_dual::chain(a, acos(v), -1.0 / sqrt((1.0 - v) * (1.0 + v)));
}
inline lm_dual real_atan2(const lm_dual &y, const lm_dual &x) {
  const double square = x.value() * x.value() + y.value() * y.value();
  return lm_dual::chain(y, atan2(y.value(), x.value()), x.value() / square) -
         lm_dual::chain(x, 0.0, y.value() / square);
}
/* The root of zero has no derivative; if it is evaluated (a chain without tolerances) no result
 * depends on it, so it is set to 0. */
inline lm_dual real_sqrt(const lm_dual &a) {
  const double root = sqrt(a.value());
  return lm_dual::chain(a, root, root > 0.0 ? 0.5 / root : 0.0);
}
inline lm_dual real_exp(const lm_dual &a) {
  const double e = exp(a.value());
  return lm_dual::chain(a, e, e);
}
inline lm_dual real_log(const lm_dual &a) {
  return lm_dual::chain(a, log(a.value()), 1.0 / a.value());
}
/* The exponent's own derivative needs a logarithm, so it is omitted if the exponent is a plain
 * number: bases of 0 are then permitted. */
inline lm_dual real_pow(const lm_dual &base, const lm_dual &exponent) {
  const double n = exponent.value();
  const double power = pow(base.value(), n);
  lm_dual result = lm_dual::chain(base, power, n * pow(base.value(), n - 1.0));
  for (int i = 0; i < LM_LANES; i++) {
    if (exponent.slope(i) != 0.0) {
      result.set_slope(i, result.slope(i) + power * log(base.value()) * exponent.slope(i));
    }
  }
  return result;
}
inline lm_dual real_fabs(const lm_dual &a) {
  return a.value() < 0.0 ? -a : a;
}
inline lm_dual real_floor(const lm_dual &a) {
  return lm_dual(floor(a.value()));
}
inline bool real_isfinite(const lm_dual &a) {
  return isfinite(a.value()) != 0;
}

inline double value_of(const lm_dual &a) {
  return a.value();
}
inline double slope_of(const lm_dual &a, int lane) {
  return a.slope(lane);
}
inline void set_slope(lm_dual *a, int lane) {
  a->set_slope(lane, 1.0);
}

#define REAL_INFINITY (lm_dual(INFINITY))

#endif
