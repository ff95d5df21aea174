"use strict";
// What a player draws: poses between those stored, bodies in space as faces, and where the camera stands.
const scene = (() => {
  const FRAMED = 1 / 3; // the least share of the stage that the body takes
  const FOLLOWING = 0.6; // height over width of a stage whose camera follows
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
  const mix = (a, b, w) => a.map((x, i) => (1 - w) * x + w * b[i]);
  const css = (c, alpha = 1) => `rgba(${c.map((x) => Math.round(x)).join(",")},${alpha})`;
  const rgb = (text) => text.match(/[\d.]+/g).slice(0, 3).map(Number);
  const hex = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));

  // Hermite's cubic between the two times about t: d·d numbers of A row by row, then d of the translation.
  function poseAt({ times, poses, rates }, t) {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    const h = times[high] - times[low], s = clamp((t - times[low]) / h, 0, 1), r = 1 - s;
    return poses[low].map((p, i) => r * r * ((1 + 2 * s) * p + h * s * rates[low][i])
      + s * s * ((1 + 2 * r) * poses[high][i] - h * r * rates[high][i]));
  }

  function carry(pose, point) {
    const d = point.length;
    return point.map((_, i) => point.reduce((sum, x, j) => sum + pose[i * d + j] * x, pose[d * d + i]));
  }

  // Right, up and towards the eye; in the plane there is nothing to turn.
  function projection(dimension, yaw, pitch) {
    if (dimension === 2) return (p) => [p[0], p[1], 0];
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    return ([x, y, z]) => [cy * y - sy * x, cp * z - sp * (cy * x + sy * y), sp * z + cp * (cy * x + sy * y)];
  }

  // How lit a face is, from 0 to 1, by Newell's normal in view coordinates; both sides alike.
  function light(face) {
    const n = [0, 0, 0];
    face.forEach((a, k) => {
      const b = face[(k + 1) % face.length];
      for (let i = 0; i < 3; i++) n[i] += (a[(i + 1) % 3] - b[(i + 1) % 3]) * (a[(i + 2) % 3] + b[(i + 2) % 3]);
    });
    const towards = (n[2] < 0 ? -1 : 1) / (Math.hypot(...n) || 1);
    return clamp(towards * (-0.35 * n[0] + 0.55 * n[1] + 0.76 * n[2]), 0, 1);
  }

  function box(corners) {
    const ends = corners[0].map((_, i) => [Math.min(...corners.map((c) => c[i])), Math.max(...corners.map((c) => c[i]))]);
    return ends.reduce((made, pair) => made.flatMap((p) => pair.map((x) => [...p, x])), [[]]);
  }

  const middle = (points) => points[0].map((_, i) => points.reduce((sum, p) => sum + p[i], 0) / points.length);

  // Where points of space are on the stage. Whichever motion is shown, so that the switch from one to another moves
  // no camera: all that is passed through, or, where the body would be small in that as it is first seen, the bodies,
  // which the camera then follows.
  function camera(data, corners, home) {
    const [begin, end] = data.domain, bounds = box(corners);
    const at = (t) => data.tracks.flatMap((track) => bounds.map((p) => carry(poseAt(track, t), p)));
    const moments = Array.from({ length: 61 }, (_, k) => at(begin + (k / 60) * (end - begin)));
    const cloud = [...data.keyframes.flatMap((pose) => bounds.map((p) => carry(pose, p))), ...moments.flat()];
    const near = moments.flatMap((points) => {
      const c = middle(points);
      return points.map((p) => p.map((x, i) => x - c[i]));
    });
    const ends = (points) => [Math.min, Math.max].map((f) =>
      [0, 1].map((i) => points.reduce((m, p) => f(m, p[i]), points[0][i])));
    function measured(project) {
      const [low, high] = ends(cloud.map(project)), size = low.map((x, i) => high[i] - x || 1);
      const reach = ends(near.map(project)), body = [0, 1].map((i) => 2 * Math.max(-reach[0][i], reach[1][i]) || 1);
      const fit = ([w, h], width, height) => Math.min(width / w, height / h);
      return {
        centre: low.map((x, i) => (x + high[i]) / 2), ratio: size[1] / size[0],
        whole: (...stage) => 0.94 * fit(size, ...stage), close: (...stage) => FRAMED * fit(body, ...stage),
      };
    }
    const first = measured(home), follows = first.close(1, FOLLOWING) > first.whole(1, FOLLOWING);
    let fitted = {};
    function places(project, view, width, height, t, all) {
      if (fitted.view !== view) fitted = { view, ...measured(project) };
      const close = follows && !all;
      const scale = close ? fitted.close(width, height) : fitted.whole(width, height);
      const [x, y] = close ? project(middle(at(t))) : fitted.centre;
      return (p) => [width / 2 + scale * (p[0] - x), height / 2 - scale * (p[1] - y)];
    }
    return { follows, ratio: follows ? FOLLOWING : clamp(1.05 * first.ratio, 0.28, 0.7), places };
  }

  return { clamp, mix, css, rgb, hex, poseAt, carry, projection, light, camera };
})();
