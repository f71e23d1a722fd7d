// SPDX-License-Identifier: Apache-2.0
// The bundler gives a .yaml as its text.
declare module "*.yaml" {
  const text: string;
  export default text;
}
