// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/io/assimp_reading.hpp"

#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <stdexcept>

namespace ecorche::foreign {

AssimpMotion assimp_motion(const std::filesystem::path& path) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  if (scene == nullptr || scene->mNumAnimations != 1) throw std::runtime_error(importer.GetErrorString());
  AssimpMotion out;
  const aiAnimation& animation = *scene->mAnimations[0];
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& channel = *animation.mChannels[c];
    auto& rotation = out.rotation[channel.mNodeName.C_Str()];
    auto& position = out.position[channel.mNodeName.C_Str()];
    for (unsigned k = 0; k < channel.mNumRotationKeys; ++k) {
      const aiQuaternion& q = channel.mRotationKeys[k].mValue;
      rotation.emplace_back(q.w, q.x, q.y, q.z);
    }
    for (unsigned k = 0; k < channel.mNumPositionKeys; ++k) {
      const aiVector3D& p = channel.mPositionKeys[k].mValue;
      position.emplace_back(p.x, p.y, p.z);
    }
  }
  return out;
}

}  // namespace ecorche::foreign
