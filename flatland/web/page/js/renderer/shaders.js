/** Sources of the shaders. Pixels are device pixels relative to the centre of the viewport, y up. */

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

/** Uniforms of the view and the transform from the world to pixels. */
const VIEW = `
uniform vec2 u_center;    // centre of the view [m]
uniform vec4 u_matrix;    // rotation and scale, by columns [pixels per metre]
uniform vec2 u_size;      // size of the viewport [pixels]
vec2 toPixels(vec2 p) { return mat2(u_matrix.xy, u_matrix.zw) * (p - u_center); }
vec4 toClip(vec2 pixels) { return vec4(2.0 * pixels / u_size, 0.0, 1.0); }
`;

/** A line with round caps, drawn as an instance of four vertices. */
const CAPSULE = `
out vec2 v_local;
flat out float v_length;
flat out float v_radius;
vec2 capsule(vec2 a, vec2 b, float width) {
  vec2 d = b - a;
  float len = length(d);
  vec2 along = len > 1e-5 ? d / len : vec2(1.0, 0.0);
  float end = float(gl_VertexID >> 1);
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  float r = 0.5 * width + 1.0;
  v_local = vec2(end * (len + 2.0 * r) - r, side * r);
  v_length = len;
  v_radius = 0.5 * width;
  return a + along * v_local.x + vec2(-along.y, along.x) * v_local.y;
}
`;

const CAPSULE_COVERAGE = `
in vec2 v_local;
flat in float v_length;
flat in float v_radius;
float coverage() {
  float x = v_local.x - clamp(v_local.x, 0.0, v_length);
  return clamp(v_radius - length(vec2(x, v_local.y)) + 0.5, 0.0, 1.0);
}
`;

/** Transform of a point of a body by the texture of poses; bodies without a pose are not drawn. */
const BODY = `
uniform sampler2D u_poses;
vec4 bodyPose(float slot) {
  int i = int(slot);
  return texelFetch(u_poses, ivec2(i & 255, i >> 8), 0);
}
vec2 ofBody(vec4 pose, vec2 p) {
  float c = cos(pose.z), s = sin(pose.z);
  return pose.xy + vec2(c * p.x - s * p.y, s * p.x + c * p.y);
}
`;

export const edgesVertex = `${HEAD}${VIEW}${CAPSULE}
in vec4 a_segment;
uniform float u_width;
void main() {
  gl_Position = toClip(capsule(toPixels(a_segment.xy), toPixels(a_segment.zw), u_width));
}`;

export const edgesFragment = `${HEAD}${CAPSULE_COVERAGE}
uniform vec4 u_color;
out vec4 color;
void main() { color = u_color * coverage(); }`;

export const thinVertex = `${HEAD}${VIEW}
in vec2 a_point;
void main() { gl_Position = toClip(toPixels(a_point)); }`;

export const flatFragment = `${HEAD}
uniform vec4 u_color;
out vec4 color;
void main() { color = u_color; }`;

export const coloredEdgesVertex = `${HEAD}${VIEW}${CAPSULE}
in vec4 a_segment;
in vec4 a_color;
in float a_width;
in float a_time;
uniform float u_time;       // [s]
uniform float u_lifetime;   // 0: lines do not fade
uniform float u_ratio;      // device pixels per CSS pixel
flat out vec4 v_color;
void main() {
  float fade = u_lifetime > 0.0 ? clamp(1.0 - (u_time - a_time) / u_lifetime, 0.0, 1.0) : 1.0;
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * fade);
  gl_Position = toClip(capsule(toPixels(a_segment.xy), toPixels(a_segment.zw), a_width * u_ratio));
}`;

export const coloredEdgesFragment = `${HEAD}${CAPSULE_COVERAGE}
flat in vec4 v_color;
out vec4 color;
void main() { color = v_color * coverage(); }`;

export const bodyEdgesVertex = `${HEAD}${VIEW}${CAPSULE}${BODY}
in vec4 a_segment;
in vec4 a_color;
in float a_slot;
uniform float u_width;
flat out vec4 v_color;
void main() {
  vec4 pose = bodyPose(a_slot);
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * pose.w);
  vec2 a = toPixels(ofBody(pose, a_segment.xy)), b = toPixels(ofBody(pose, a_segment.zw));
  gl_Position = toClip(capsule(a, b, u_width));
}`;

export const bodyFillVertex = `${HEAD}${VIEW}${BODY}
in vec2 a_point;
in vec4 a_color;
in float a_slot;
uniform float u_opacity;
flat out vec4 v_color;
void main() {
  vec4 pose = bodyPose(a_slot);
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * pose.w * u_opacity);
  gl_Position = toClip(toPixels(ofBody(pose, a_point)));
}`;

export const colorFragment = `${HEAD}
flat in vec4 v_color;
out vec4 color;
void main() { color = v_color; }`;

/** Lasers: two texels each; (x, y, heading, largest range), (first angle, increment, count, colour). */
const SCAN = `
uniform sampler2D u_lasers;
uniform vec3 u_palette[8];
vec4 laserTexel(float laser, int k) {
  int i = 2 * int(laser) + k;
  return texelFetch(u_lasers, ivec2(i & 255, i >> 8), 0);
}
// Ranges are fractions of the largest one, from 0 to 65534; 65535 stands for no hit.
bool isHit(float fraction) { return fraction < 65534.5; }
vec2 beamEnd(vec4 pose, vec4 beams, float beam, float fraction) {
  float range = min(fraction / 65534.0, 1.0) * pose.w;
  float angle = pose.z + beams.x + beam * beams.y;
  return pose.xy + range * vec2(cos(angle), sin(angle));
}
`;

export const scanPointsVertex = `${HEAD}${VIEW}${SCAN}
in vec2 a_beam;    // laser, beam
in float a_range;
uniform float u_pointSize;
flat out vec3 v_color;
void main() {
  vec4 pose = laserTexel(a_beam.x, 0), beams = laserTexel(a_beam.x, 1);
  v_color = u_palette[int(beams.w)];
  gl_PointSize = u_pointSize;
  gl_Position = isHit(a_range) ? toClip(toPixels(beamEnd(pose, beams, a_beam.y, a_range))) : vec4(2.0, 2.0, 2.0, 1.0);
}`;

export const scanPointsFragment = `${HEAD}
flat in vec3 v_color;
uniform float u_pointSize;
out vec4 color;
void main() {
  float d = length(gl_PointCoord - 0.5) * u_pointSize;
  color = vec4(v_color, 1.0) * clamp(0.5 * u_pointSize - d + 0.5, 0.0, 1.0);
}`;

/** A triangle between two beams, drawn as an instance of three vertices. */
export const scanAreaVertex = `${HEAD}${VIEW}${SCAN}
in vec2 a_beam;
in float a_range;
in float a_nextRange;
uniform float u_opacity;
flat out vec4 v_color;
void main() {
  vec4 pose = laserTexel(a_beam.x, 0), beams = laserTexel(a_beam.x, 1);
  v_color = vec4(u_palette[int(beams.w)], 1.0) * u_opacity;
  float range = gl_VertexID == 1 ? a_range : a_nextRange;
  vec2 p = pose.xy;
  if (gl_VertexID > 0 && a_beam.y + 1.5 < beams.z) {
    p = beamEnd(pose, beams, a_beam.y + float(gl_VertexID - 1), range);
  }
  gl_Position = toClip(toPixels(p));
}`;

export const textVertex = `${HEAD}${VIEW}
in vec2 a_anchor;   // [m]
in vec4 a_box;      // offset and size [pixels]
in vec4 a_texels;   // offset and size in the atlas [texels]
uniform vec2 u_atlasSize;
out vec2 v_texel;
void main() {
  vec2 corner = vec2(float(gl_VertexID >> 1), float(gl_VertexID & 1));
  v_texel = (a_texels.xy + corner * a_texels.zw) / u_atlasSize;
  vec2 anchor = floor(toPixels(a_anchor) + 0.5 * u_size) - 0.5 * u_size;
  gl_Position = toClip(anchor + vec2(a_box.x + corner.x * a_box.z, -(a_box.y + corner.y * a_box.w)));
}`;

export const textFragment = `${HEAD}
in vec2 v_texel;
uniform sampler2D u_atlas;   // red: glyph, green: halo
uniform vec3 u_color;
uniform vec2 u_channels;     // weights of glyph and halo
out vec4 color;
void main() {
  vec4 texel = texture(u_atlas, v_texel);
  color = vec4(u_color, 1.0) * max(u_channels.x * texel.r, u_channels.y * texel.g);
}`;
