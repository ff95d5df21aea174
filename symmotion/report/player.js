"use strict";
// A player in every figure that brings a motion: the script replaces the still picture, which print still shows.
(() => {
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const bodies = JSON.parse(document.getElementById("bodies").textContent);
  const STEPS = 200; // of the slider
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

  function element(tag, properties = {}, ...children) {
    const made = document.createElement(tag);
    for (const [key, value] of Object.entries(properties)) {
      if (key in made) made[key] = value; else made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
  }

  function start(figure, index) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const body = bodies[data.body], d = data.dimension, tracks = data.tracks, [begin, end] = data.domain;
    const home = [Math.atan2(data.direction[1], data.direction[0]),
      Math.atan2(data.direction[2], Math.hypot(data.direction[0], data.direction[1]))];
    const digits = clamp(2 - Math.floor(Math.log10(end - begin)), 0, 12);
    const seconds = data.unit === "s" ? clamp(end - begin, 3, 12) : 6;
    let t = begin, shown = 0, playing = false, visible = false, stale = true, last = 0; // stale: a frame is asked for
    let [yaw, pitch] = home;
    const sampled = (track, steps) =>
      Array.from({ length: steps + 1 }, (_, k) => poseAt(track, begin + (k / steps) * (end - begin)));
    const chosen = () => (shown < tracks.length ? [tracks[shown]] : tracks);

    // The controls.
    const name = data.name;
    const canvas = element("canvas", { role: "img", "aria-label": data.alt });
    const play = element("button", { type: "button", className: "play" });
    const scrub = element("input", { type: "range", max: STEPS, step: 1, value: 0, "aria-label": `Time, ${name}` });
    const clock = element("output", { "aria-live": "off" });
    const more = element("div", {}), key = element("span", { className: "key" });
    const controls = element("div", { className: "controls", role: "group", "aria-label": `Player, ${name}` },
      element("div", {}, play, scrub, clock), more);
    if (tracks.length === 2) {
      const choice = element("fieldset", {}, element("legend", { textContent: "Before or after" }));
      [...tracks.map((track) => track.label), "both"].forEach((label, k) => {
        const input = element("input", { type: "radio", name: `track-${index}`, value: k, checked: k === shown });
        input.addEventListener("change", () => choose(k));
        choice.append(element("label", {}, input, " ", ...swatch(k), label));
      });
      more.append(choice);
    } else if (tracks.length > 2) {
      const choice = element("select", { "aria-label": `Motion, ${name}` });
      choice.append(...[...tracks.map((track) => track.label), "all"].map((label, k) =>
        element("option", { value: k, textContent: label, selected: k === shown })));
      choice.addEventListener("change", () => choose(Number(choice.value)));
      more.append(choice, key);
    }
    const still = element("button", { type: "button", textContent: "Still picture", "aria-pressed": "false" });
    const views = element("span", { className: "views" }, still);
    if (d === 3) {
      canvas.tabIndex = 0;
      canvas.setAttribute("aria-label", `${data.alt} Arrow keys turn the view.`);
      const reset = element("button", { type: "button", className: "reset", textContent: "Reset view" });
      reset.addEventListener("click", () => turn(home[0] - yaw, home[1] - pitch));
      views.prepend(reset);
    }
    more.append(views);
    figure.querySelector(".box").after(element("div", { className: "stage" }, canvas), controls);
    figure.querySelector("figcaption").append(element("span", { textContent: data.caption }));
    figure.classList.add("moving");

    function swatch(k) {
      if (k >= tracks.length) return [];
      const made = element("i", { className: "swatch" });
      made.style.background = tracks[k].colour;
      return [made];
    }
    // Of several bodies at once, which colour is which; one alone is named by the choice.
    function explain() {
      const all = shown >= tracks.length;
      key.replaceChildren(...(all ? tracks.map((track, k) => element("span", {}, ...swatch(k), track.label)) : swatch(shown)));
    }
    function choose(k) {
      shown = k;
      explain();
      picture(false);
      refresh();
    }
    function picture(on) {
      still.setAttribute("aria-pressed", on);
      figure.classList.toggle("moving", !on);
    }
    function seek(time) {
      t = clamp(time, begin, end);
      picture(false);
      refresh();
    }
    function turn(left, up) {
      yaw += left;
      pitch = clamp(pitch + up, -Math.PI / 2, Math.PI / 2);
      refresh();
    }
    function toggle(on = !playing) {
      playing = on;
      if (on && t >= end) t = begin;
      if (on) picture(false);
      last = 0;
      label();
      refresh();
    }
    function label() {
      play.textContent = playing ? "❚❚ Pause" : "▶ Play";
      play.setAttribute("aria-label", `${playing ? "Pause" : "Play"}, ${name}`);
    }

    // What is shown follows the state at the next frame; out of sight it is drawn once, so that nobody meets it blank.
    function refresh() {
      if (!stale) requestAnimationFrame(frame);
      stale = true;
    }
    function frame(now) {
      stale = false;
      if (playing && visible) {
        if (last) t += ((now - last) / 1000 / seconds) * (end - begin);
        last = now;
        if (t > end && calm.matches) toggle(false);
        t = t > end ? (calm.matches ? end : begin) : t;
        refresh();
      }
      if (visible || !canvas.dataset.drawn) draw();
    }
    function say(poses) {
      const unit = data.unit ? ` ${data.unit}` : "";
      const centre = carry(poses[0], data.centre).map((x) => Number(x.toPrecision(3)));
      scrub.value = Math.round(((t - begin) / (end - begin)) * STEPS);
      clock.textContent = `${t.toFixed(digits)}${unit}`;
      scrub.setAttribute("aria-valuetext", `${clock.textContent}, body at ${centre.join(", ")}`);
      Object.assign(figure.dataset, { time: t, pose: poses[0].join(" "), view: `${yaw} ${pitch}`, playing });
    }

    // Everything that is passed through fits, whichever motion is shown: the switch from one to another moves no camera.
    let cloud, fitted = {};
    function fit(project, width, height) {
      const key = `${yaw} ${pitch} ${width} ${height}`;
      if (fitted.key === key) return fitted;
      const corners = cloud ? [] : box(body.corners);
      cloud ??= [...data.keyframes, ...tracks.flatMap((track) => sampled(track, 60))]
        .flatMap((pose) => corners.map((p) => carry(pose, p)));
      const seen = cloud.map(project);
      const [low, high] = [Math.min, Math.max].map((f) => [0, 1].map((i) => seen.reduce((m, p) => f(m, p[i]), seen[0][i])));
      const size = [high[0] - low[0], high[1] - low[1]];
      const scale = 0.94 * Math.min(width / (size[0] || 1), height / (size[1] || 1));
      const [x, y] = [0, 1].map((i) => (low[i] + high[i]) / 2);
      const place = (p) => [width / 2 + scale * (p[0] - x), height / 2 - scale * (p[1] - y)];
      return (fitted = { key, place, ratio: size[1] / (size[0] || 1) });
    }
    function box(corners) {
      const ends = corners[0].map((_, i) => [Math.min(...corners.map((c) => c[i])), Math.max(...corners.map((c) => c[i]))]);
      return ends.reduce((made, pair) => made.flatMap((p) => pair.map((x) => [...p, x])), [[]]);
    }

    function draw() {
      const context = canvas.getContext("2d"), poses = chosen().map((track) => poseAt(track, t));
      const project = projection(d, yaw, pitch), width = canvas.clientWidth, height = canvas.clientHeight;
      say(poses);
      if (!width) return;
      canvas.dataset.drawn = true;
      const sharp = window.devicePixelRatio || 1;
      canvas.width = Math.round(width * sharp);
      canvas.height = Math.round(height * sharp);
      context.scale(sharp, sharp);
      context.lineJoin = "round";
      const { place } = fit(project, width, height);
      const ink = rgb(getComputedStyle(figure).color), paper = rgb(getComputedStyle(document.body).backgroundColor);
      const trace = (points, close) => {
        context.beginPath();
        points.forEach((p, i) => context[i ? "lineTo" : "moveTo"](...p));
        if (close) context.closePath();
      };
      for (const track of chosen()) {
        trace(sampled(track, 120).map((pose) => place(project(carry(pose, data.centre)))));
        context.strokeStyle = css(ink, 0.55);
        context.lineWidth = 1;
        context.stroke();
      }
      // Painter's order: what is far first; in the plane the keyframes, then the bodies.
      const faces = [];
      const add = (pose, colour, ghost) => {
        const seen = body.corners.map((p) => project(carry(pose, p)));
        for (const face of body.faces) {
          const points = face.map((i) => seen[i]);
          faces.push({ points, colour, ghost, depth: points.reduce((sum, p) => sum + p[2], 0) / points.length });
        }
      };
      data.keyframes.forEach((pose) => add(pose, ink, true));
      poses.forEach((pose, k) => add(pose, hex(chosen()[k].colour), false));
      const faint = data.keyframes.length > 8 ? 0.5 : 1, fine = body.faces.length > 24;
      const solid = poses.length > 1 ? 0.6 : d === 3 ? 1 : 0.85;
      faces.sort((a, b) => a.depth - b.depth);
      for (const { points, colour, ghost } of faces) {
        const lit = d === 3 ? light(points) : 1;
        const lift = (lit > 0.6 ? 0.55 : 0.5) * Math.abs(lit - 0.6);
        const shade = d === 2 ? colour : mix(colour, lit > 0.6 ? [255, 255, 255] : [0, 0, 0], lift);
        trace(points.map(place), true);
        context.fillStyle = ghost ? css(mix(paper, ink, 0.25 + 0.35 * (1 - lit)), 0.33 * faint) : css(shade, solid);
        context.fill();
        // Edges of few faces are drawn; those of many only close the gaps between them.
        const edge = fine || d === 2 ? shade : mix(shade, [0, 0, 0], 0.35);
        context.lineWidth = fine ? 0.5 : 1;
        context.strokeStyle = ghost ? css(ink, 0.4 * faint) : css(edge, fine ? solid : 1);
        if (!(ghost && fine)) context.stroke();
      }
      for (const pose of poses) {
        context.beginPath();
        context.arc(...place(project(carry(pose, data.centre))), 2.5, 0, 7);
        context.fillStyle = css(ink);
        context.fill();
      }
    }

    // What the reader does.
    play.addEventListener("click", () => toggle());
    scrub.addEventListener("input", () => seek(begin + (scrub.value / STEPS) * (end - begin)));
    scrub.addEventListener("pointerdown", () => toggle(false));
    still.addEventListener("click", () => {
      toggle(false);
      picture(figure.classList.contains("moving"));
      refresh();
    });
    figure.addEventListener("keydown", (event) => {
      if (event.key === " " && (event.target === scrub || event.target === canvas)) {
        event.preventDefault();
        toggle();
      }
    });
    if (d === 3) {
      const keys = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
      canvas.addEventListener("keydown", (event) => {
        if (!keys[event.key]) return;
        event.preventDefault();
        turn(...keys[event.key]);
      });
      let held;
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        held = event;
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!canvas.hasPointerCapture(event.pointerId)) return;
        turn((held.clientX - event.clientX) * 0.01, (event.clientY - held.clientY) * 0.01);
        held = event;
      });
    }
    const { ratio } = fit(projection(d, yaw, pitch), 1, 1);
    canvas.style.aspectRatio = String(1 / clamp(ratio * 1.05, 0.28, 0.7));
    new ResizeObserver(refresh).observe(canvas);
    new IntersectionObserver(([entry]) => {
      visible = entry.isIntersecting;
      last = 0;
      refresh();
    }).observe(figure);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
    label();
    explain();
    say(chosen().map((track) => poseAt(track, t)));
    stale = false;
    refresh();
  }

  document.querySelectorAll("figure.player").forEach(start);
})();
