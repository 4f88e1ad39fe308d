/* Complex-step differentiation, the oracle of optimizer/dual.h: f(x + i h) = f(x) + i h f'(x) with
 * h so small that its square vanishes. One direction per pass. Multiplication, division and
 * functions are those of the complex plane, not rules of differentiation. Comparisons use the real
 * part.
 */
#ifndef LOSTMOTION_TESTS_COMPLEX_NUMBER_H
#define LOSTMOTION_TESTS_COMPLEX_NUMBER_H

#include <math.h>

#include <complex>

#define LM_NUMBER_SPACE lm_with_complex_step
#define LM_NUMBER_SIZE lm_complex_workspace_size
#define LM_NUMBER_EVALUATE lm_complex_evaluate

#define LM_LANES 1
#define COMPLEX_STEP 1e-100

class lm_complex {
 public:
  lm_complex() = default;
  template <class number>
  explicit lm_complex(number plain) : re_(static_cast<double>(plain)), im_(0.0) {
  }
  explicit lm_complex(const std::complex<double> &z) : re_(z.real()), im_(z.imag()) {
  }

  std::complex<double> z() const {
    return std::complex<double>(re_, im_);
  }
  double real() const {
    return re_;
  }
  double value() const {
    return re_;
  }
  double imag() const {
    return im_;
  }
  void set_imag(double im) {
    im_ = im;
  }
  explicit operator int() const {
    return static_cast<int>(re_);
  }
  lm_complex operator-() const {
    return lm_complex(-z());
  }
  lm_complex &operator+=(const lm_complex &b) {
    return *this = lm_complex(z() + b.z());
  }
  lm_complex &operator-=(const lm_complex &b) {
    return *this = lm_complex(z() - b.z());
  }
  /* Written out: an infinite factor (no overlap) must not become NaN by 0 * infinity in the real
   * part, for which compilers have different rules. */
  lm_complex &operator*=(const lm_complex &b) {
    const double re = re_ * b.re_ - im_ * b.im_;
    im_ = re_ * b.im_ + im_ * b.re_;
    re_ = re;
    return *this;
  }
  lm_complex &operator/=(const lm_complex &b) {
    const double square = b.re_ * b.re_ + b.im_ * b.im_;
    const double re = (re_ * b.re_ + im_ * b.im_) / square;
    im_ = (im_ * b.re_ - re_ * b.im_) / square;
    re_ = re;
    return *this;
  }

 private:
  double re_;
  double im_;
};

typedef lm_complex lm_real;

inline lm_complex operator+(lm_complex a, const lm_complex &b) {
  return a += b;
}
inline lm_complex operator-(lm_complex a, const lm_complex &b) {
  return a -= b;
}
inline lm_complex operator*(lm_complex a, const lm_complex &b) {
  return a *= b;
}
inline lm_complex operator/(lm_complex a, const lm_complex &b) {
  return a /= b;
}
inline bool operator<(const lm_complex &a, const lm_complex &b) {
  return a.real() < b.real();
}
inline bool operator>(const lm_complex &a, const lm_complex &b) {
  return a.real() > b.real();
}
inline bool operator<=(const lm_complex &a, const lm_complex &b) {
  return a.real() <= b.real();
}
inline bool operator>=(const lm_complex &a, const lm_complex &b) {
  return a.real() >= b.real();
}
inline bool operator==(const lm_complex &a, const lm_complex &b) {
  return a.real() == b.real();
}
inline bool operator!=(const lm_complex &a, const lm_complex &b) {
  return a.real() != b.real();
}

/* sin(x + iy) = sin x cosh y + i cos x sinh y, and so on: the library's complex functions do the
 * same, and more accurately for large y. */
inline lm_complex real_sin(const lm_complex &a) {
  return lm_complex(std::sin(a.z()));
}
inline lm_complex real_cos(const lm_complex &a) {
  return lm_complex(std::cos(a.z()));
}
inline lm_complex real_tan(const lm_complex &a) {
  return real_sin(a) / real_cos(a);
}
inline lm_complex real_exp(const lm_complex &a) {
  return lm_complex(std::exp(a.z()));
}
inline lm_complex real_log(const lm_complex &a) {
  return lm_complex(std::log(a.z()));
}
inline lm_complex real_pow(const lm_complex &base, const lm_complex &exponent) {
  return lm_complex(std::exp(exponent.z() * std::log(base.z())));
}
/* The library's complex root and inverse functions lose an imaginary part of 1e-100 by squaring it.
 * These start from the real result and take one complex Newton step, which is exact to h^2. */
inline lm_complex real_sqrt(const lm_complex &a) {
  const lm_complex root(sqrt(a.real()));
  if (a.real() == 0.0) {
    return root;
  }
  return (root + a / root) / lm_complex(2.0);
}
inline lm_complex real_atan(const lm_complex &a) {
  const lm_complex angle(atan(a.real()));
  const lm_complex t = real_tan(angle);
  return angle + (a - lm_complex(a.real())) / (lm_complex(1.0) + t * t);
}
inline lm_complex real_acos(const lm_complex &a) {
  const lm_complex angle(acos(a.real()));
  return angle - (a - lm_complex(a.real())) / real_sin(angle);
}
inline lm_complex real_atan2(const lm_complex &y, const lm_complex &x) {
  const lm_complex angle(atan2(y.real(), x.real()));
  const lm_complex s = real_sin(angle);
  const lm_complex c = real_cos(angle);
  /* r sin(difference) and r cos(difference); the difference has the order of the step */

  const std::complex<double> turned =
      (y * c - x * s).z() - std::complex<double>((y * c - x * s).real(), 0.0);
  return angle + lm_complex(turned) / (x * c + y * s);
}
inline lm_complex real_fabs(const lm_complex &a) {
  return a.real() < 0.0 ? -a : a;
}
inline lm_complex real_floor(const lm_complex &a) {
  return lm_complex(floor(a.real()));
}
inline bool real_isfinite(const lm_complex &a) {
  return std::isfinite(a.real());
}
inline double value_of(const lm_complex &a) {
  return a.real();
}
inline double slope_of(const lm_complex &a, int) {
  return a.imag() / COMPLEX_STEP;
}
inline void set_slope(lm_complex *a, int) {
  a->set_imag(COMPLEX_STEP);
}

#define REAL_INFINITY (lm_complex(INFINITY))

#endif
