printf '\0\0\0\001\0\0\0\001\0\0\0\006' > feu.smb; texel bake feu.smb -o x.texel
