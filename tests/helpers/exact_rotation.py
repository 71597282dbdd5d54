"""The free rotation of a rigid body in 50 digits."""

from dataclasses import dataclass

import mpmath as mp

DIGITS = 80  # leaves 50 after 1e12 rad of phase and a modulus within 1e-17 of one


def multiply(p, q):
    (a, b, c, d), (w, x, y, z) = p, q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def about(axis, angle):
    """Quaternion of a turn by `angle` about body axis 0, 1 or 2."""
    q = [mp.cos(angle / 2), mp.mpf(0), mp.mpf(0), mp.mpf(0)]
    q[axis + 1] = mp.sin(angle / 2)
    return tuple(q)


@dataclass
class Truth:
    """The motion of one body with moments I1 <= I2 <= I3 (exact doubles) and q = 1 at t = 0, to about 50 digits."""

    moments: tuple
    momentum: tuple

    def __post_init__(self):
        self.i = tuple(mp.mpf(float(x)) for x in self.moments)
        self.m = tuple(mp.mpf(float(x)) for x in self.momentum)
        self.g = mp.sqrt(sum(x * x for x in self.m))
        rate = [m / i if i else mp.mpf(0) for m, i in zip(self.m, self.i, strict=True)]
        cross = [self.m[(a + 1) % 3] * rate[(a + 2) % 3] - self.m[(a + 2) % 3] * rate[(a + 1) % 3] for a in range(3)]
        self.steady = max(abs(c) for c in cross) < mp.mpf(10) ** -60 * self.g  # products of doubles: 1e-34 or zero
        self.omega = rate
        if not self.steady:
            self._asymmetric()

    def _asymmetric(self):
        (i1, i2, i3), (m1, m2, m3), g = self.i, self.m, self.g
        i21, i31, i32 = i2 - i1, i3 - i1, i3 - i2
        d1 = m2**2 * i21 / i2 + m3**2 * i31 / i3
        d2 = m3**2 * i32 / i3 - m1**2 * i21 / i1
        d3 = -(m1**2 * i31 / i1 + m2**2 * i32 / i2)
        self.b13, self.b31 = mp.sqrt(-i1 * d3 / i31), mp.sqrt(i3 * d1 / i31)
        self.case = "iii" if d2 == 0 else "i" if d2 < 0 else "ii"
        if self.case == "iii":
            self.size = mp.sqrt(-d1 * d3 / (i1 * i3)) / g
            return
        self.flip = (m1 if self.case == "i" else m3) < 0
        y1, y2, y3 = (-m1, m2, -m3) if self.flip else (m1, m2, m3)
        if self.case == "i":
            self.mc, self.size = d2 * i31 / (d3 * i21), mp.sqrt(-d3 * i21 / (i1 * i2 * i3))
            self.b2, self.n, self.axis = mp.sqrt(i2 * d1 / i21), -i1 * i32 / (i3 * i21), 0
            sn, cn = -y2 / self.b2, y3 / self.b31
            self.sign, self.root = -1, (mp.sqrt(i2 * i31), mp.sqrt(i3 * i21))
        else:
            self.mc, self.size = d2 * i31 / (d1 * i32), mp.sqrt(d1 * i32 / (i1 * i2 * i3))
            self.b2, self.n, self.axis = mp.sqrt(-i2 * d3 / i32), -i3 * i21 / (i1 * i32), 2
            sn, cn = -y2 / self.b2, y1 / self.b13
            self.sign, self.root = 1, (mp.sqrt(i2 * i31), mp.sqrt(i1 * i32))
        self.lam = -self.size
        self.quarter = mp.pi / 2 / mp.agm(1, mp.sqrt(self.mc))
        self.third = mp.elliprf(0, self.mc, 1) + self.n / 3 * mp.elliprj(0, self.mc, 1, 1 - self.n)
        u = mp.sign(sn) * abs(sn) * mp.elliprf(cn**2, cn**2 + self.mc * sn**2, 1)
        self.start = u if cn >= 0 else (2 if sn >= 0 else -2) * self.quarter - u
        self.start_psi = self._psi(mp.mpf(0))
        self.period = 4 * self.quarter / self.size

    def _functions(self, u):
        j = mp.nint(u / (2 * self.quarter))
        r = u - 2 * j * self.quarter
        # sn by the descending Landen (AGM) recurrence, DLMF 22.20(ii); accurate for any mc
        a, b, c = [mp.mpf(1)], mp.sqrt(self.mc), []
        while not c or abs(c[-1]) > mp.mpf(10) ** (-mp.mp.dps + 2):
            c.append((a[-1] - b) / 2)
            a.append((a[-1] + b) / 2)
            b = mp.sqrt(a[-2] * b)
        angle = 2 ** len(c) * a[-1] * r
        for k in range(len(c), 0, -1):
            angle = (angle + mp.asin(c[k - 1] / a[k] * mp.sin(angle))) / 2
        sn, cn = mp.sin(angle), mp.cos(angle)
        return j, sn, cn, mp.sqrt(cn**2 + self.mc * sn**2)

    def _psi(self, t):
        (i1, _, i3), n = self.i, self.n
        j, sn, cn, dn = self._functions(self.lam * t + self.start)
        pi_u = 2 * j * self.third + sn * mp.elliprf(cn**2, dn**2, 1)
        pi_u += n / 3 * sn**3 * mp.elliprj(cn**2, dn**2, 1, 1 - n * sn**2)
        moment = self.i[self.axis]
        angle = mp.atan2(self.root[0] * sn, self.root[1] * cn) + j * mp.pi
        drift = self.g * (i3 - i1) / (self.lam * i1 * i3) * pi_u
        return self.g / moment * t + self.sign * (drift + angle)

    def at(self, t):
        t = mp.mpf(t)
        if self.steady:
            size = mp.sqrt(sum(w * w for w in self.omega))
            if not size:
                return self.m, (mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0))
            return self.m, (mp.cos(size * t / 2), *(w / size * mp.sin(size * t / 2) for w in self.omega))
        if self.case == "iii":
            return self._on_separatrix(t)
        j, sn, cn, dn = self._functions(self.lam * t + self.start)
        sn, cn = (-1) ** int(j % 2) * sn, (-1) ** int(j % 2) * cn
        y2 = -self.b2 * sn
        y = (self.b13 * dn, y2, self.b31 * cn) if self.case == "i" else (self.b13 * cn, y2, self.b31 * dn)
        y0 = (-self.m[0], self.m[1], -self.m[2]) if self.flip else self.m
        half_turn = (mp.mpf(0), mp.mpf(0), mp.mpf(1), mp.mpf(0)) if self.flip else (mp.mpf(1), 0, 0, 0)
        turned = multiply(about(self.axis, self._psi(t) - self.start_psi), self._pole(y))
        q = multiply(multiply(conjugate(half_turn), conjugate(self._pole(y0))), multiply(turned, half_turn))
        return ((-y[0], y[1], -y[2]) if self.flip else y), q

    def _pole(self, y):
        """The rotation that takes L/G to axis 1 (case i) or axis 3 (case ii)."""
        p0 = mp.sqrt((1 + y[self.axis] / self.g) / 2)
        if self.axis == 0:
            return (p0, mp.mpf(0), y[2] / (2 * self.g * p0), -y[1] / (2 * self.g * p0))
        return (p0, y[1] / (2 * self.g * p0), -y[0] / (2 * self.g * p0), mp.mpf(0))

    def _on_separatrix(self, t):
        """L = (s1 B13 sech v, s1 s3 G tanh v, s3 B31 sech v); the angle about axis 3 is elementary."""
        g, b, i3 = self.g, self.b31, self.i[2]
        s1, s3 = mp.sign(self.m[0]), mp.sign(self.m[2])
        twice_energy = sum(m * m / i for m, i in zip(self.m, self.i, strict=True))

        def momentum(v):
            return self.b13 * mp.sech(v), s1 * s3 * g * mp.tanh(v), b * mp.sech(v)

        def psi(v):  # ∫ (2T + G L3/I3)/(G + L3) dt with dt = dv/λ
            inner = 2 / self.b13 * mp.atan(mp.tanh(v / 2) * mp.sqrt((g - b) / (g + b)))
            return (g / i3 * v + (twice_energy - g * g / i3) * (v / g - b / g * inner)) / self.size

        v0 = mp.atanh(s1 * s3 * self.m[1] / g)
        v = v0 + self.size * t
        self.axis = 2
        # seen after a turn by π about axis 2 where L3 < 0, then both s1 and s3 are those of the turned body
        turn = (mp.mpf(1), 0, 0, 0) if s3 > 0 else (mp.mpf(0), mp.mpf(0), mp.mpf(1), mp.mpf(0))
        k = s1 * s3

        def seen(v):
            first, second, third = momentum(v)
            return (k * first, second, third)

        turned = multiply(about(2, psi(v) - psi(v0)), self._pole(seen(v)))
        q = multiply(multiply(conjugate(turn), conjugate(self._pole(seen(v0)))), multiply(turned, turn))
        y = seen(v)
        return ((s3 * y[0], y[1], s3 * y[2]), q)


def angle(exact, q):
    w, x, y, z = multiply(conjugate(exact), tuple(mp.mpf(float(c)) for c in q))
    return float(2 * mp.atan2(mp.sqrt(x * x + y * y + z * z), abs(w)))
