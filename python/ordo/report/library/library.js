// What reports draw with, as globalThis.library. Only what is named here gets into library.min.js: npm ci && npm run build.
import {
  BufferAttribute, BufferGeometry, Color, DataTexture, DoubleSide, InstancedBufferAttribute, InstancedBufferGeometry, LinearFilter,
  LineBasicMaterial, LineSegments, Mesh, OrthographicCamera, PerspectiveCamera, Quaternion, RGBAFormat, Scene, ShaderMaterial, Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import uPlot from "uplot";

globalThis.library = {
  BufferAttribute, BufferGeometry, Color, DataTexture, DoubleSide, InstancedBufferAttribute, InstancedBufferGeometry, LinearFilter,
  LineBasicMaterial, LineSegments, Mesh, OrbitControls, OrthographicCamera, PerspectiveCamera, Quaternion, RGBAFormat, Scene, ShaderMaterial,
  uPlot, Vector3, WebGLRenderer,
};
