"""Codecs: conversion between bytes on the wire and values."""
