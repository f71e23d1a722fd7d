// SPDX-License-Identifier: Apache-2.0
// What a client says when it asks for inverse kinematics.
export interface IkOptions {
  /** Four per joint; none: the present pose. */
  from?: ArrayLike<number>;
  /** Show the result, too; for the controller. */
  apply?: boolean;
  /** The whole body may turn and go. */
  moveRoot?: boolean;
}
