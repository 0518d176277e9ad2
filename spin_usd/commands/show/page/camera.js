"use strict";
// The pinhole camera with Brown and Conrady's distortion, or a fisheye of four coefficients, as spin_usd.geometry has
// them: (0, 0) is the image's corner.

class Camera {
    /** limit: the radius, at z = 1, below which the lens is one to one; null for none. */
    constructor(found, limit) {
        Object.assign(this, found);
        this.limit = limit ?? Infinity;
        this.fisheye = this.distortion.length === 4;
        this.plain = !this.fisheye && this.distortion.every((each) => each === 0);
    }

    /** Return the pixel of the point in the camera's axes; null where the lens sees none. */
    project([x, y, z]) {
        if (!(z > 0) || Math.hypot(x, y) / z >= this.limit) return null;
        const [u, v] = this.distorted(x / z, y / z);
        return [u * this.fx + this.cx, v * this.fy + this.cy];
    }

    /** Return how far from the principal point a fisheye sees the angle, in focal lengths, and the slope of that. */
    distance(t) {
        const [k1, k2, k3, k4] = this.distortion,
            tt = t * t;
        return [
            t * (1 + tt * (k1 + tt * (k2 + tt * (k3 + tt * k4)))),
            1 + tt * (3 * k1 + tt * (5 * k2 + tt * (7 * k3 + tt * 9 * k4))),
        ];
    }

    distorted(x, y) {
        if (this.fisheye) {
            const r = Math.hypot(x, y),
                share = r ? this.distance(Math.atan(r))[0] / r : 1;
            return [x * share, y * share];
        }
        const [k1, k2, p1, p2, k3] = this.distortion;
        const r2 = x * x + y * y;
        const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
        return [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ];
    }

    /** Return x and y at z = 1 of the ray through the pixel, by Newton's method from `start`; null where it does not
     * arrive: a ray within the limit is the only one there. */
    ray(u, v, start) {
        const wantX = (u - this.cx) / this.fx,
            wantY = (v - this.cy) / this.fy;
        if (this.plain) return [wantX, wantY];
        if (this.fisheye) {
            const far = Math.hypot(wantX, wantY);
            let t = Math.min(far, 1.5);
            for (let step = 0; step < 50; step += 1) {
                const [reached, slope] = this.distance(t);
                t = Math.min(Math.max(t - (reached - far) / slope, 0), Math.PI / 2);
            }
            const share = far ? Math.tan(t) / far : 1,
                seen = Math.abs(this.distance(t)[0] - far) < 1e-12 && Math.tan(t) < Math.min(this.limit, 1e9);
            return seen ? [wantX * share, wantY * share] : null;
        }
        const [k1, k2, p1, p2, k3] = this.distortion;
        let [x, y] = start ?? [wantX, wantY];
        for (let step = 0; step < 50; step += 1) {
            const [nowX, nowY] = this.distorted(x, y);
            const ex = nowX - wantX,
                ey = nowY - wantY;
            if (Math.abs(ex) + Math.abs(ey) < 1e-14) break;
            const r2 = x * x + y * y;
            const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
            const slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2));
            const a = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x;
            const b = slope * x * y + 2 * p1 * x + 2 * p2 * y;
            const d = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x;
            const determinant = a * d - b * b;
            x -= (d * ex - b * ey) / determinant;
            y -= (a * ey - b * ex) / determinant;
        }
        const [endX, endY] = this.distorted(x, y);
        const arrived = Math.abs(endX - wantX) + Math.abs(endY - wantY) < 1e-12 && Math.hypot(x, y) < this.limit;
        return arrived ? [x, y] : null;
    }
}

/** Return the rows of the rotation that the unit quaternion, scalar first, is. */
function rotation([w, x, y, z]) {
    const n = 2 / (w * w + x * x + y * y + z * z);
    return [
        [1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)],
        [n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)],
        [n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)],
    ];
}

/** Return the point of the camera's axes that is `point` in the axes with that pose. */
function toCamera({ q_cam_body, t_cam_body }, point) {
    return rotation(q_cam_body).map(
        (row, axis) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + t_cam_body[axis],
    );
}

/** Return the point of the axes with that pose that is `point` in the camera's axes. */
function toBody({ q_cam_body, t_cam_body }, point) {
    const rows = rotation(q_cam_body);
    const away = point.map((each, axis) => each - t_cam_body[axis]);
    return [0, 1, 2].map((axis) => rows[0][axis] * away[0] + rows[1][axis] * away[1] + rows[2][axis] * away[2]);
}
